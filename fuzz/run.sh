#!/usr/bin/env bash
# Coverage-guided fuzzing of one reader on the stable toolchain: fuzz/run.sh NAME [RUNS], for example fuzz/run.sh mat 1000000.
# The names are those of the folders of seeds, crates/youla-io/tests/seeds. Needs a C++ compiler for libFuzzer.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
name=${1:?which reader}
runs=${2:-1000000}

# What `cargo fuzz` passes without a sanitizer that needs the nightly toolchain.
export RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing"
target=$(rustc -vV | sed -n 's/^host: //p')
cargo build --release --target "$target"
folder=${CARGO_TARGET_DIR:-target}
found=$folder/corpus/$name
mkdir -p "$found"
# A megabyte per input of at most 4 kB is let through, a gigabyte is not.
YOULA_READER=$name exec "$folder/$target/release/readers" "$found" "../crates/youla-io/tests/seeds/$name" \
    -runs="$runs" -max_len=4096 -rss_limit_mb=1024 -malloc_limit_mb=512 -timeout=10 -print_final_stats=1
