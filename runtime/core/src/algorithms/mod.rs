//! The algorithms of rigid-body dynamics, one file each, generic over the scalar.
