//! Hand motion as data: from the texts of motion files to tracks of hand samples, and back.
//!
//! Pure functions; whoever calls them reads and writes the files. World space is that of the whole project:
//! metres, right-handed, y up.

/// The hand CSV: the project's own file of hand motion.
pub mod hand_csv;
/// From recorded sets to tracks.
pub mod import;
/// What is wrong with a motion file, and where.
pub mod mistake;
mod rows;
mod table;
/// Hands that are computed: the paper's operations by name.
pub mod synthetic;
/// Hand samples over time, and what lies between them.
pub mod track;
