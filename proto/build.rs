//! Generates messages, clients and servers from the schema, without a system `protoc`.

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message;
use tonic_prost_build::manual;

/// The schema's root folder.
const ROOT: &str = "proto";
/// Files that reach every other one through their imports.
const FILES: [&str; 3] = [
    "tsukamu/v1/service.proto",
    "tsukamu/v1/recording.proto",
    "tsukamu/v1/calibration.proto",
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed={ROOT}");
    println!("cargo::rerun-if-changed=build.rs");
    let mut compiler = protox::Compiler::new([ROOT])?;
    compiler
        .include_source_info(true)
        .include_imports(true)
        .open_files(FILES)?;
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    fs::write(
        out.join("descriptors.bin"),
        compiler.encode_file_descriptor_set(),
    )?;
    let descriptors =
        prost_types::FileDescriptorSet::decode(compiler.encode_file_descriptor_set().as_slice())?;
    tonic_prost_build::configure()
        .emit_rerun_if_changed(false)
        .compile_fds(descriptors)?;
    manual::Builder::new()
        .build_client(false)
        .compile(&[world_of_encoded_frames()]);
    Ok(())
}

/// The `World` service once more, with `WatchFrames` and `WatchEvents` answering in bytes that are encoded already.
fn world_of_encoded_frames() -> manual::Service {
    manual::Service::builder()
        .name("World")
        .package("tsukamu.v1")
        .comment("The world: what is in it and what happens. Frames come encoded.")
        .method(
            method("get_scene", "GetScene")
                .output_type("crate::v1::GetSceneResponse")
                .build(),
        )
        .method(
            encoded_stream("watch_frames", "WatchFrames")
                .comment("Items: encoded `WatchFramesResponse`.")
                .build(),
        )
        .method(
            encoded_stream("watch_events", "WatchEvents")
                .comment("Items: encoded `Event`.")
                .build(),
        )
        .method(
            method("get_status", "GetStatus")
                .output_type("crate::v1::GetStatusResponse")
                .build(),
        )
        .build()
}

fn encoded_stream(name: &str, route: &str) -> manual::MethodBuilder {
    method(name, route)
        .output_type("bytes::Bytes")
        .codec_path("crate::codec::EncodedCodec")
        .server_streaming()
}

fn method(name: &str, route: &str) -> manual::MethodBuilder {
    manual::Method::builder()
        .name(name)
        .route_name(route)
        .input_type(format!("crate::v1::{route}Request"))
        .codec_path("tonic_prost::ProstCodec")
}
