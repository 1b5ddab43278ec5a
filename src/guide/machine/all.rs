// The machine of the tutorial `own_scene`, for those of its examples that do not show it.
use moreau2d::contact::Vec2;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

include!("drum.rs");
include!("concave.rs");
include!("grains.rs");
