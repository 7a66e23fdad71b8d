//! The measured error of a stream's prediction: what was predicted for a time, against what later arrived for it.

use std::collections::VecDeque;

use super::moving::{Moving, sizes};

/// Seconds over which the error is taken.
const WINDOW_S: usize = 5;
/// Nanoseconds per second.
const SECOND_NS: i64 = 1_000_000_000;
/// Predictions that wait for their time, at most.
const N_WAITING: usize = 32;
/// Shortest time between two that wait, in nanoseconds: so many reach beyond the longest prediction.
const SPACING_NS: i64 = 4_000_000;

/// Root mean squares of errors of a change's two kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Of the prediction.
    pub predicted: [f64; 2],
    /// Of the newest sample where nothing had been predicted: what the prediction is to be measured by.
    pub unpredicted: [f64; 2],
}

/// Compares one stream's predictions with its samples.
#[derive(Clone, Debug)]
pub struct Score<T> {
    waiting: VecDeque<Waiting<T>>,
    /// The last sample, as it arrived.
    last: Option<(i64, T)>,
    /// One entry per second, by second modulo the window.
    seconds: [Second; WINDOW_S],
}

#[derive(Clone, Debug)]
struct Waiting<T> {
    for_ns: i64,
    predicted: T,
    newest: T,
}

/// Sums of squares of one second.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    /// Which one, since the clock's start.
    index: i64,
    n: u32,
    predicted: [f64; 2],
    unpredicted: [f64; 2],
}

impl<T> Default for Score<T> {
    fn default() -> Self {
        Self {
            waiting: VecDeque::with_capacity(N_WAITING),
            last: None,
            seconds: [Second::default(); WINDOW_S],
        }
    }
}

impl<T> Score<T> {
    /// The stream has a gap: what was predicted beyond it is not compared with anything.
    pub fn cut(&mut self) {
        self.waiting.clear();
        self.last = None;
    }

    /// A prediction for a time, and the newest sample that it was made from.
    pub fn expect(&mut self, for_ns: i64, predicted: T, newest: T) {
        let is_spaced = |last: &Waiting<T>| for_ns - last.for_ns >= SPACING_NS;
        if self.waiting.len() < N_WAITING && self.waiting.back().is_none_or(is_spaced) {
            self.waiting.push_back(Waiting {
                for_ns,
                predicted,
                newest,
            });
        }
    }

    /// A sample as it arrived, later than the last one.
    pub fn arrive<const N: usize>(&mut self, at_ns: i64, value: &T)
    where
        T: Moving<N>,
    {
        while let Some(waiting) = self.waiting.pop_front_if(|waiting| waiting.for_ns <= at_ns) {
            let Some((last_ns, last)) = &self.last else {
                continue;
            };
            let (since, way) = (waiting.for_ns - last_ns, at_ns - last_ns);
            if since < 0 || way <= 0 {
                continue;
            }
            let truth = last.toward(value, since as f64 / way as f64);
            let second = second_at(&mut self.seconds, at_ns);
            second.n += 1;
            let squares =
                |from: &T| sizes::<T, N>(&truth.change_from(from)).map(|size| size * size);
            add(&mut second.predicted, squares(&waiting.predicted));
            add(&mut second.unpredicted, squares(&waiting.newest));
        }
        self.last = Some((at_ns, value.clone()));
    }

    /// The errors at a time; `None` while nothing was predicted in the window.
    pub fn errors(&self, now_ns: i64) -> Option<Errors> {
        let oldest = now_ns.div_euclid(SECOND_NS) - WINDOW_S as i64 + 1;
        let mut sum = Second::default();
        for second in self.seconds.iter().filter(|second| second.index >= oldest) {
            sum.n += second.n;
            add(&mut sum.predicted, second.predicted);
            add(&mut sum.unpredicted, second.unpredicted);
        }
        let rms = |squares: [f64; 2]| squares.map(|square| (square / f64::from(sum.n)).sqrt());
        (sum.n > 0).then(|| Errors {
            predicted: rms(sum.predicted),
            unpredicted: rms(sum.unpredicted),
        })
    }
}

fn second_at(seconds: &mut [Second; WINDOW_S], at_ns: i64) -> &mut Second {
    let index = at_ns.div_euclid(SECOND_NS);
    let second = &mut seconds[index.rem_euclid(WINDOW_S as i64) as usize];
    if second.index != index {
        *second = Second {
            index,
            ..Second::default()
        };
    }
    second
}

fn add(sum: &mut [f64; 2], more: [f64; 2]) {
    sum.iter_mut()
        .zip(more)
        .for_each(|(sum, more)| *sum += more);
}
