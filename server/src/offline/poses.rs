//! Object poses as a table, a row per tick and object.
//!
//! Columns: `tick`; `time_s`, world time; `object`, its name; `x,y,z` of its centre of gravity, metres, world space;
//! `qx,qy,qz,qw`, its rotation; `state`: `free`, `push-1`, `push-n` or `grasped`; `hand`, the name of the hand that
//! it follows, `several` where only the contacts of several hands together hold it, empty where none does.

use std::fmt::Write as _;
use std::io::Write;

use tsukamu_world::World;
use tsukamu_world::state::Body;

use super::names::NameBook;

/// The columns.
pub const COLUMNS: [&str; 12] = [
    "tick", "time_s", "object", "x", "y", "z", "qx", "qy", "qz", "qw", "state", "hand",
];

/// Writes the table. Numbers are the shortest that read back as themselves.
#[derive(Debug)]
pub struct PoseTable<W: Write> {
    rows: csv::Writer<W>,
    cell: String,
}

impl<W: Write> PoseTable<W> {
    /// A table with its header; `before` are further columns on the left.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(to: W, before: &[&str]) -> csv::Result<Self> {
        let mut rows = csv::Writer::from_writer(to);
        rows.write_record(before.iter().chain(&COLUMNS))?;
        Ok(Self {
            rows,
            cell: String::new(),
        })
    }

    /// A row for every object as it stands after the last step; `before` are the cells of the further columns.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_step(
        &mut self,
        world: &World,
        names: &NameBook,
        before: &[String],
    ) -> csv::Result<()> {
        let frame = world.frame();
        for (id, body) in world.objects() {
            before
                .iter()
                .try_for_each(|cell| self.rows.write_field(cell))?;
            self.number(frame.tick)?;
            self.number(frame.time_s)?;
            self.rows.write_field(names.object(id))?;
            let position = body.pose.translation.vector;
            let rotation = body.pose.rotation.coords;
            position
                .iter()
                .chain(rotation.iter())
                .try_for_each(|number| self.number(number))?;
            self.rows.write_field(body.contact.name())?;
            self.rows.write_field(holder(body, names))?;
            self.rows.write_record(None::<&[u8]>)?;
        }
        Ok(())
    }

    /// Writes what waits.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> csv::Result<()> {
        Ok(self.rows.flush()?)
    }

    fn number(&mut self, number: impl std::fmt::Debug) -> csv::Result<()> {
        self.cell.clear();
        // Debug is the shortest text that reads back, with an exponent where Display would write twenty zeros.
        write!(self.cell, "{number:?}").expect("a String takes all that is written to it");
        self.rows.write_field(&self.cell)
    }
}

/// Name of the hand that an object follows, as in the `hand` column.
pub fn holder(body: &Body, names: &NameBook) -> String {
    match &body.hold {
        None => String::new(),
        Some(hold) => hold
            .leader
            .map_or_else(|| "several".to_owned(), |hand| names.hand(hand)),
    }
}
