#!/bin/sh
# rustdoc with its unstable options, for RUSTDOC. In the environment of cargo the variable would compile the
# dependencies again.
RUSTC_BOOTSTRAP=1 exec rustdoc "$@"
