//! Checks what `[[wear]]` and `[life]` need of each other and of the rest of the file.

use super::*;
use crate::scene::file::BodyKind;

pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    if file.wear.is_empty() {
        let why = "[life] says how long the bodies of [[wear]] wear; there are none";
        return top.refuse(&["life"], true, why);
    }
    if file.life.is_none() {
        return Err(top
            .key("wear")
            .missing("life.duration (for how long the bodies wear)"));
    }
    let why = "a closed form knows no wear; leave out [reference] or [[wear]]";
    top.refuse(&["reference"], true, why)?;
    let still = |kind, belt: f64| kind == BodyKind::Fixed && belt == 0.0;
    if file
        .body
        .iter()
        .all(|body| still(body.kind, body.surface_velocity))
    {
        return Err(top.key("wear").conflict("nothing moves in this scene"));
    }
    Ok(())
}
