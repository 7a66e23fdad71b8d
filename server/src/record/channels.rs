//! The channels of a recording and what they carry.

use prost::Message;
use prost_types::FileDescriptorSet;
use tsukamu_proto::v1;

use crate::recorder_handle::RecordItem;

/// One kind of message in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topic {
    Scene,
    Input,
    Event,
    Digest,
    Frame,
    Raw,
    Sample,
}

impl Topic {
    pub(super) const ALL: [Self; 7] = [
        Self::Scene,
        Self::Input,
        Self::Event,
        Self::Digest,
        Self::Frame,
        Self::Raw,
        Self::Sample,
    ];

    /// The channel's name.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Scene => "/scene",
            Self::Input => "/inputs",
            Self::Event => "/events",
            Self::Digest => "/digests",
            Self::Frame => "/frames",
            Self::Raw => "/raw",
            Self::Sample => "/samples",
        }
    }

    /// Full name of its protobuf message.
    pub(super) const fn schema(self) -> &'static str {
        match self {
            Self::Scene => "tsukamu.v1.SceneRecord",
            Self::Input => "tsukamu.v1.StepInput",
            Self::Event => "tsukamu.v1.Event",
            Self::Digest => "tsukamu.v1.Digest",
            Self::Frame => "tsukamu.v1.Frame",
            Self::Raw => "tsukamu.v1.RawBytes",
            Self::Sample => "tsukamu.v1.RawSample",
        }
    }

    /// The topic of that channel.
    pub(super) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }

    /// Which topic an item belongs to.
    pub(super) const fn of(item: &RecordItem) -> Self {
        match item {
            RecordItem::Scene(_) => Self::Scene,
            RecordItem::Input(_) => Self::Input,
            RecordItem::Event(_) => Self::Event,
            RecordItem::Digest(_) => Self::Digest,
            RecordItem::Frame(_) => Self::Frame,
            RecordItem::Raw(_) => Self::Raw,
            RecordItem::Sample(_) => Self::Sample,
        }
    }

    /// The item in these bytes.
    pub(super) fn decode(self, bytes: &[u8]) -> Result<RecordItem, prost::DecodeError> {
        Ok(match self {
            Self::Scene => RecordItem::Scene(Box::new(v1::SceneRecord::decode(bytes)?)),
            Self::Input => RecordItem::Input(v1::StepInput::decode(bytes)?),
            Self::Event => RecordItem::Event(bytes.to_vec().into()),
            Self::Digest => RecordItem::Digest(v1::Digest::decode(bytes)?),
            Self::Frame => RecordItem::Frame(bytes.to_vec().into()),
            Self::Raw => RecordItem::Raw(v1::RawBytes::decode(bytes)?),
            Self::Sample => RecordItem::Sample(v1::RawSample::decode(bytes)?),
        })
    }
}

/// Writes the item's message after clearing the buffer.
pub(super) fn encode(item: &RecordItem, buffer: &mut Vec<u8>) {
    buffer.clear();
    let written = match item {
        RecordItem::Scene(message) => message.encode(buffer),
        RecordItem::Input(message) => message.encode(buffer),
        RecordItem::Digest(message) => message.encode(buffer),
        RecordItem::Raw(message) => message.encode(buffer),
        RecordItem::Sample(message) => message.encode(buffer),
        RecordItem::Event(bytes) | RecordItem::Frame(bytes) => {
            buffer.extend_from_slice(bytes);
            Ok(())
        }
    };
    written.expect("a vector takes every message");
}

/// The schema of all messages, without the comments: they would be most of a short recording.
pub(super) fn schema_bytes() -> Vec<u8> {
    let mut files = FileDescriptorSet::decode(tsukamu_proto::FILE_DESCRIPTOR_SET)
        .expect("the descriptor set is made by this build");
    files
        .file
        .iter_mut()
        .for_each(|file| file.source_code_info = None);
    files.encode_to_vec()
}
