#!/usr/bin/env bash
# Builds the Debian package: target/debian/tsukamu_*.deb. Needs cargo-deb (`cargo install cargo-deb --locked`).
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TARGET_DIR=target
made=target/package
cargo deb --version > /dev/null
cargo build --release --locked -p tsukamu-server -p tsukamu-client
rm -rf "$made"
mkdir -p "$made/completions"
for program in tsukamud tsukamu; do
  target/release/$program man -o "$made/man" 2>/dev/null
  target/release/$program completions bash > "$made/completions/$program.bash"
  target/release/$program completions zsh > "$made/completions/_$program"
  target/release/$program completions fish > "$made/completions/$program.fish"
done
cargo deb --no-build --strip --locked -p tsukamu-server "$@"
