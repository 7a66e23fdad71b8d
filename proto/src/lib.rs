//! The wire schema of Tsukamu and the code generated from it: no logic, no conversions.
//!
//! The schema itself, with units and spaces of every field, is in `proto/proto/tsukamu/v1`.

#![allow(
    clippy::allow_attributes_without_reason,
    reason = "generated code; inside a module it has no effect"
)]

/// Messages, clients and servers of the package `tsukamu.v1`.
#[allow(
    missing_docs,
    clippy::all,
    clippy::pedantic,
    rustdoc::all,
    unused_qualifications,
    reason = "generated code"
)]
pub mod v1 {
    tonic::include_proto!("tsukamu.v1");
}

/// The server of `tsukamu.v1.World` without its two streams.
///
/// A daemon that encodes a frame once for all its subscribers answers `WatchFrames` and `WatchEvents` itself, on routes
/// beside this one; [`v1::world_server`] is the whole service.
#[allow(
    missing_docs,
    clippy::all,
    clippy::pedantic,
    rustdoc::all,
    unused_qualifications,
    reason = "generated code"
)]
pub mod unary {
    include!(concat!(env!("OUT_DIR"), "/tsukamu.v1.World.rs"));
}

/// Every schema file with its comments, as one encoded `google.protobuf.FileDescriptorSet`: for reflection and for
/// the schemas inside recordings.
pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));

/// Major number of the protocol: clients refuse another one.
pub const PROTOCOL_MAJOR: u32 = 1;
/// Minor number of the protocol: grows with additions.
pub const PROTOCOL_MINOR: u32 = 0;
