#!/usr/bin/env bash
# The house rules of includes and of what lies where, as a test: tests/layering.sh [ROOT] | --self-test (layering.py).
exec python3 "$(dirname "${BASH_SOURCE[0]}")/layering.py" "$@"
