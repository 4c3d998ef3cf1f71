#!/usr/bin/env bash
# Runs every command of the verification pages into results/verification, figures included, and writes the tables of the
# pages again from what came out: `git diff` then shows what differs from what is committed.
#
#     examples/verification/reproduce.sh [NAME…]      all pages, or those of the scenes named; some minutes in release
#
# Needs Rust, or a program named in NICOLSON, and Python 3 without packages.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

if [[ -z ${NICOLSON:-} ]]; then
    cargo build --release
    NICOLSON=${CARGO_TARGET_DIR:-target}/release/nicolson
fi
mkdir -p results/verification

if (($# == 0)); then
    for page in examples/verification/*.md; do
        [[ $page == */README.md ]] || set -- "$@" "$(basename "$page" .md)"
    done
fi

# The lines of the pages that begin with four spaces and `nicolson`, as a shell takes them.
nicolson() {
    if [[ $1 == run ]]; then
        set -- "$@" --quiet
    fi
    "$NICOLSON" "$@"
}
for name in "$@"; do
    while IFS= read -r line; do
        printf '%s\n' "$line"
        # 3: the run failed numerically, which is what some rows show.
        eval "$line" || (($? == 3))
    done < <(sed -n 's/^    \(nicolson .*\)/\1/p' "examples/verification/$name.md")
    python3 examples/verification/tables.py "$name"
done
