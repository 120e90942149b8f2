//! src/bth-tetgen-protocol
