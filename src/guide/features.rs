//! What of rapier2d is here.
