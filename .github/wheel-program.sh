#!/usr/bin/env bash
# Puts the program `regrasp` into the wheel that maturin builds next: bash .github/wheel-program.sh TARGET_TRIPLE. The program carries its
# demo scene along. Changes pyproject.toml, so run it on a checkout that is thrown away.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$1
command -v cargo >/dev/null || { curl -sSf https://sh.rustup.rs | sh -s -- -y --profile minimal && . "$HOME/.cargo/env"; }
rustup target add "$target"
cargo build --profile dist --locked --target "$target" -p regrasp_cli
mkdir -p regrasp.data/scripts
for program in regrasp regrasp.exe; do
  if [ -f "target/$target/dist/$program" ]; then cp "target/$target/dist/$program" regrasp.data/scripts/; fi
done
python=$(command -v python3 || command -v python)
"$python" - <<'PY'
from pathlib import Path
path = Path("pyproject.toml")
text = path.read_text(encoding="utf-8")
if 'data = "regrasp.data"' not in text:
    path.write_text(text.replace("[tool.maturin]\n", '[tool.maturin]\ndata = "regrasp.data"\n', 1), encoding="utf-8")
PY
