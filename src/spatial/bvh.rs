//! A bounding volume hierarchy with leaves of the caller.
