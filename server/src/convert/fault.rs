//! Why a message is refused, and which gRPC status says so.

use thiserror::Error;
use tonic::Status;
use tsukamu_world::hand::skeleton::HandModelFault;
use tsukamu_world::polyhedron::fault::ShapeFault;

use crate::document::mistake::Mistakes;
use crate::plan::PlanFault;
use crate::record::RecordFault;
use crate::recording_desk::DeskFault;
use crate::ticker::request::Refusal;

/// What is wrong with a message.
#[derive(Debug, Error, PartialEq)]
pub enum Fault {
    /// A field that must be there is not.
    #[error("{0} is missing")]
    Missing(&'static str),
    /// A number is infinite or not a number.
    #[error("{0} is not finite")]
    NotFinite(&'static str),
    /// A rotation has no direction.
    #[error("{0} is no rotation: its length is {1}, it must be 1")]
    NotRotation(&'static str, f64),
    /// A list has the wrong length.
    #[error("{field} has {found} numbers, it must have {expected}")]
    Length {
        /// The list.
        field: &'static str,
        /// How many numbers it has.
        found: usize,
        /// How many it must have.
        expected: &'static str,
    },
    /// An enumeration or a name with a value that is not known.
    #[error("{field} is {value}: it must be one of {allowed}")]
    Unknown {
        /// The field.
        field: &'static str,
        /// What it says.
        value: String,
        /// What it may say.
        allowed: &'static str,
    },
    /// A name that is none.
    #[error("a name has at most {0} bytes and no control characters")]
    Name(usize),
    /// A list of faces whose counts do not fit its length.
    #[error("faces ends in the middle of a face")]
    FacesCut,
    /// A face with holes, without the triangles that say how it is filled.
    #[error("face {0} has holes: give the triangles too")]
    Holes(usize),
    /// Two ways of saying one thing.
    #[error("give either {0} or {1}, not both")]
    Both(&'static str, &'static str),
    /// A shape that is no solid.
    #[error("shape of {object:?}: {fault}")]
    Shape {
        /// The object.
        object: String,
        /// What is wrong.
        fault: ShapeFault,
    },
    /// A hand that cannot be.
    #[error("hand model: {0}")]
    HandModel(#[from] HandModelFault),
}

/// Longest text of a status, bytes: it travels in a header, escaped up to threefold, and clients take 16 kB of headers.
const TEXT_MAX: usize = 4000;

/// The text of a status, cut where it is too long to arrive.
pub fn status_text(fault: &impl ToString) -> String {
    let mut text = fault.to_string();
    if text.len() > TEXT_MAX {
        text.truncate(text.floor_char_boundary(TEXT_MAX));
        text.push_str(" … and so on");
    }
    text
}

impl From<Fault> for Status {
    fn from(fault: Fault) -> Self {
        Self::invalid_argument(status_text(&fault))
    }
}

impl From<Refusal> for Status {
    fn from(refusal: Refusal) -> Self {
        let text = status_text(&refusal);
        match refusal {
            Refusal::Stopping => Self::unavailable(text),
            Refusal::Busy | Refusal::TooManyHands => Self::resource_exhausted(text),
            Refusal::NotLockstep
            | Refusal::NotRealtime
            | Refusal::Playing
            | Refusal::Recording(_)
            | Refusal::NotRecording => Self::failed_precondition(text),
            Refusal::Steps(_) | Refusal::Object(_) => Self::invalid_argument(text),
            Refusal::NoObject(_) => Self::not_found(text),
            Refusal::NewEpoch => Self::aborted(text),
        }
    }
}

impl From<Mistakes> for Status {
    fn from(mistakes: Mistakes) -> Self {
        Self::invalid_argument(status_text(&mistakes))
    }
}

impl From<PlanFault> for Status {
    fn from(fault: PlanFault) -> Self {
        Self::invalid_argument(status_text(&fault))
    }
}

impl From<DeskFault> for Status {
    fn from(fault: DeskFault) -> Self {
        let text = status_text(&fault);
        match fault {
            DeskFault::Refused(refusal) => refusal.into(),
            DeskFault::Name(_) => Self::invalid_argument(text),
            DeskFault::Absent(_) => Self::not_found(text),
            DeskFault::Taken(_) => Self::already_exists(text),
            DeskFault::Folder { .. } | DeskFault::Record(RecordFault::Open { .. }) => {
                Self::failed_precondition(text)
            }
            DeskFault::NoScene | DeskFault::Beginning(_) => Self::data_loss(text),
            DeskFault::Record(_) | DeskFault::Thread(_) => Self::internal(text),
        }
    }
}
