use console::Style;

/// A drawing of lines in cells of two by four dots (the braille letters), each cell in the colour of its last line.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    cells: Vec<Cell>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    dots: u8,
    colour: Option<[u8; 3]>,
}

impl Canvas {
    /// Columns and lines of the terminal.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            cells: vec![Cell::default(); width * height],
        }
    }

    /// Dots across and down.
    pub(super) fn size_dots(&self) -> (f64, f64) {
        ((2 * self.width) as f64, (4 * self.height) as f64)
    }

    /// A straight line between two points in dots, from the upper left; what lies outside is left out.
    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], colour: Option<[u8; 3]>) {
        let Some((from, to)) = self.clip(from, to) else {
            return;
        };
        let n_steps = (to[0] - from[0])
            .abs()
            .max((to[1] - from[1]).abs())
            .ceil()
            .max(1.0);
        for step in 0..=n_steps as usize {
            let share = step as f64 / n_steps;
            self.dot(
                [
                    from[0] + (to[0] - from[0]) * share,
                    from[1] + (to[1] - from[1]) * share,
                ],
                colour,
            );
        }
    }

    /// One dot.
    pub(super) fn dot(&mut self, [x, y]: [f64; 2], colour: Option<[u8; 3]>) {
        let (width, height) = self.size_dots();
        if !(x >= 0.0 && x < width && y >= 0.0 && y < height) {
            return;
        }
        let (x, y) = (x as usize, y as usize);
        let cell = &mut self.cells[y / 4 * self.width + x / 2];
        cell.dots |= dot_bit(x % 2, y % 4);
        cell.colour = colour;
    }

    /// The lines of the terminal.
    pub(super) fn lines(&self) -> Vec<String> {
        self.cells.chunks(self.width.max(1)).map(line_of).collect()
    }

    /// The part of a line that lies on the canvas (Liang and Barsky 1984).
    fn clip(&self, from: [f64; 2], to: [f64; 2]) -> Option<([f64; 2], [f64; 2])> {
        if !from.iter().chain(&to).all(|value| value.is_finite()) {
            return None;
        }
        let (width, height) = self.size_dots();
        let way = [to[0] - from[0], to[1] - from[1]];
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for (speed, room) in [
            (-way[0], from[0]),
            (way[0], width - 1.0 - from[0]),
            (-way[1], from[1]),
            (way[1], height - 1.0 - from[1]),
        ] {
            if speed == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if speed < 0.0 {
                enter = enter.max(room / speed);
            } else {
                leave = leave.min(room / speed);
            }
        }
        let at = |share: f64| [from[0] + way[0] * share, from[1] + way[1] * share];
        (enter <= leave).then(|| (at(enter), at(leave)))
    }
}

/// The bit of a dot in the braille block: columns of three, then the lowest row.
const fn dot_bit(x: usize, y: usize) -> u8 {
    match (x, y) {
        (0, 3) => 0x40,
        (_, 3) => 0x80,
        (0, y) => 1 << y,
        (_, y) => 8 << y,
    }
}

fn line_of(cells: &[Cell]) -> String {
    let mut text = String::new();
    for run in cells.chunk_by(|a, b| a.colour == b.colour) {
        let letters: String = run.iter().map(|cell| letter(cell.dots)).collect();
        match run[0].colour {
            Some([red, green, blue]) => {
                text += &Style::new()
                    .true_color(red, green, blue)
                    .apply_to(letters)
                    .to_string();
            }
            None => text += &letters,
        }
    }
    text
}

fn letter(dots: u8) -> char {
    if dots == 0 {
        ' '
    } else {
        char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' ')
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(lines: &[([f64; 2], [f64; 2])], expected: &[&str]) {
        let mut canvas = Canvas::new(3, 2);
        for (from, to) in lines {
            canvas.line(*from, *to, None);
        }
        assert_eq!(canvas.lines(), expected);
    }

    #[test]
    fn lines_become_dots() {
        check(&[], &["   ", "   "]);
        check(&[([0.0, 0.0], [5.0, 0.0])], &["⠉⠉⠉", "   "]);
        check(&[([0.0, 0.0], [0.0, 7.0])], &["⡇  ", "⡇  "]);
        check(&[([0.0, 0.0], [3.0, 3.0])], &["⠑⢄ ", "   "]);
    }

    #[test]
    fn what_lies_outside_is_left_out() {
        check(&[([-1e9, 0.0], [1e9, 0.0])], &["⠉⠉⠉", "   "]);
        check(
            &[([-5.0, -5.0], [50.0, -4.0]), ([f64::NAN, 0.0], [1.0, 1.0])],
            &["   ", "   "],
        );
        let mut empty = Canvas::new(0, 0);
        empty.line([0.0, 0.0], [1.0, 1.0], None);
        assert!(empty.lines().is_empty());
    }
}
