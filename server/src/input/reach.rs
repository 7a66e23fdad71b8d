//! How often each sensor of a glove is beyond its calibrated range.

use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;

/// Seconds that are looked back on.
const WINDOW_S: usize = 10;
/// Nanoseconds per second.
const SECOND_NS: u64 = 1_000_000_000;
/// Samples without which a share says nothing.
const SAMPLES_MIN: u32 = 50;

/// Counts, by second modulo the window.
#[derive(Clone, Debug, Default)]
pub struct Reach {
    seconds: [Second; WINDOW_S],
}

#[derive(Clone, Copy, Debug, Default)]
struct Second {
    index: u64,
    n_samples: u32,
    n_beyond: [u32; GloveSensor::N_SLOTS],
}

impl Reach {
    /// Takes a sample whose angles are valid.
    pub fn note(&mut self, reading: &GloveReading) {
        if !reading.angles_valid {
            return;
        }
        let index = reading.stamp_ns / SECOND_NS;
        let second = &mut self.seconds[index as usize % WINDOW_S];
        if second.index != index {
            *second = Second {
                index,
                ..Second::default()
            };
        }
        second.n_samples += 1;
        for (count, sensor) in second.n_beyond.iter_mut().zip(&reading.sensors) {
            *count += u32::from(sensor.is_some_and(|sensor| sensor.clamped));
        }
    }

    /// The sensor that most often was beyond its range, and the share of the samples in which it was; `None` where there
    /// are too few.
    pub fn worst(&self, now_ns: u64) -> Option<(GloveSensor, f64)> {
        let oldest = (now_ns / SECOND_NS).saturating_sub(WINDOW_S as u64 - 1);
        let mut n_samples = 0;
        let mut n_beyond = [0; GloveSensor::N_SLOTS];
        for second in self.seconds.iter().filter(|s| s.index >= oldest) {
            n_samples += second.n_samples;
            for (sum, count) in n_beyond.iter_mut().zip(second.n_beyond) {
                *sum += count;
            }
        }
        if n_samples < SAMPLES_MIN {
            return None;
        }
        let of = |sensor: &GloveSensor| n_beyond[sensor.slot()];
        let worst = GloveSensor::ALL.into_iter().max_by_key(of)?;
        Some((worst, f64::from(of(&worst)) / f64::from(n_samples)))
    }
}

#[cfg(test)]
mod tests {
    use tsukamu_devices::reading::SensorReading;

    use super::*;

    #[test]
    fn the_worst_sensor_is_named_and_the_past_is_forgotten() {
        let mut reach = Reach::default();
        for k in 0..400_u64 {
            let mut reading = GloveReading {
                angles_valid: true,
                ..GloveReading::empty(k * 10_000_000, k)
            };
            for (sensor, clamped) in [
                (GloveSensor::IndexMcp, k % 4 == 0),
                (GloveSensor::RingPip, k % 4 != 0),
            ] {
                reading.sensors[sensor.slot()] = Some(SensorReading {
                    raw: 1.0,
                    angle_rad: 0.0,
                    clamped,
                });
            }
            reach.note(&reading);
        }
        assert_eq!(
            reach.worst(4 * SECOND_NS),
            Some((GloveSensor::RingPip, 0.75))
        );
        assert_eq!(reach.worst(30 * SECOND_NS), None);
        let unplugged = GloveReading::empty(31 * SECOND_NS, 0);
        (0..100).for_each(|_| reach.note(&unplugged));
        assert_eq!(reach.worst(31 * SECOND_NS), None, "its angles say nothing");
    }
}
