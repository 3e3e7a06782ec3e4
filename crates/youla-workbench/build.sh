#!/usr/bin/env bash
# Builds what the page of the workbench runs, assets/youla-workbench.wasm.gz, from this checkout; needs the target wasm32-wasip1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
cargo build --locked --profile page --target wasm32-wasip1 -p youla-workbench
built=${CARGO_TARGET_DIR:-target}/wasm32-wasip1/page/youla-workbench.wasm
gzip -9 -n -c "$built" >crates/youla-workbench/assets/youla-workbench.wasm.gz
ls -l "$built" crates/youla-workbench/assets/youla-workbench.wasm.gz
