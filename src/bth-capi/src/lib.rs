//! src/bth-capi
