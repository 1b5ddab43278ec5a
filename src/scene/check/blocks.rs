//! Which blocks a file may hold together.

use super::*;

pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    let models: Vec<&str> = [
        ("study", file.study.is_some()),
        ("thresher", file.thresher.is_some()),
        ("linear", file.linear.is_some()),
    ]
    .into_iter()
    .filter_map(|(key, given)| given.then_some(key))
    .collect();
    if let [first, second, ..] = models[..] {
        let problem = format!("a scene is a [{first}] or a [{second}], not both");
        return Err(top.key(second).conflict(problem));
    }
    let blocks = [
        ("body", !file.body.is_empty()),
        ("joint", !file.joint.is_empty()),
        ("repeat", !file.repeat.is_empty()),
        ("material", !file.material.is_empty()),
    ];
    if let [model] = models[..] {
        if let Some((key, _)) = blocks.into_iter().find(|(_, given)| *given) {
            let problem = format!("[{model}] makes its own bodies; [[{key}]] would have no effect");
            return Err(top.key(key).conflict(problem));
        }
    } else if file.body.is_empty() {
        return Err(SceneError::NoBodies {
            file: top.document.file.clone(),
        });
    }
    if file.linear.is_some() && file.gravity != Gravity::default() {
        let problem = "[linear] has its gravity in `load`; [gravity] would have no effect";
        return Err(top.key("gravity").conflict(problem));
    }
    if file.study.is_none() && file.thresher.is_none() {
        for (key, given) in [
            ("tooth", file.tooth.is_some()),
            ("wear", file.wear.is_some()),
        ] {
            if given {
                return Err(top
                    .key(key)
                    .conflict(format!("[{key}] needs a [study] or a [thresher] to act on")));
            }
        }
    }
    if let Some(block) = &file.linear {
        linear::check(&top.key("linear"), block)?;
    }
    machine::check(top, file)
}
