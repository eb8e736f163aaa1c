//! Tests of the cluster, in one binary.

mod cluster;
