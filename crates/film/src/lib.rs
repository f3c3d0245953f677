//! Tiles, moments, EXR with metadata, PNG and PFM.
