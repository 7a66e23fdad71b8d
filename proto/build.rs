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
        .compile(&[world_without_streams()]);
    Ok(())
}

/// The `World` service once more, without `WatchFrames` and `WatchEvents`: the daemon answers those itself, with bytes that
/// are encoded already.
fn world_without_streams() -> manual::Service {
    manual::Service::builder()
        .name("World")
        .package("tsukamu.v1")
        .comment("The world: what is in it and how it does.")
        .method(method("get_scene", "GetScene").build())
        .method(method("get_status", "GetStatus").build())
        .build()
}

fn method(name: &str, route: &str) -> manual::MethodBuilder {
    manual::Method::builder()
        .name(name)
        .route_name(route)
        .input_type(format!("crate::v1::{route}Request"))
        .output_type(format!("crate::v1::{route}Response"))
        .codec_path("tonic_prost::ProstCodec")
}
