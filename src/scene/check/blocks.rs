//! Checks which blocks a file combines: a scene consists of bodies, of a mechanism or of a machine.

use super::*;

pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    let models = ["study", "thresher", "linear"];
    let models: Vec<&str> = models.into_iter().filter(|m| top.written(m)).collect();
    if let [first, second, ..] = models[..] {
        let problem = format!("a scene is a [{first}] or a [{second}], not both");
        return Err(top.key(second).conflict(problem));
    }
    if let [model] = models[..] {
        top.refuse(
            &["body", "joint", "repeat", "material"],
            true,
            &format!("[{model}] makes its own bodies; [[{{key}}]] would have no effect"),
        )?;
        let why = format!("[{model}] makes its own bodies; [[wear]] is for the bodies of a scene");
        top.refuse(
            &["wear", "life"],
            !file.wear.is_empty() || file.life.is_some(),
            &why,
        )?;
    } else if file.body.is_empty() {
        return Err(SceneError::NoBodies {
            file: top.document.file.clone(),
        });
    }
    top.refuse(
        &["gravity"],
        file.linear.is_some(),
        "[linear] has its gravity in `load`; [gravity] would have no effect",
    )?;
    let wears = file.study.is_some() || file.thresher.is_some();
    top.refuse(
        &["tooth"],
        !wears,
        "[{key}] needs a [study] or a [thresher] to act on",
    )?;
    top.refuse(
        &["wear"],
        !wears && file.wear.is_empty(),
        "[wear] needs a [study] or a [thresher] to act on; [[wear]] is for bodies of a scene",
    )?;
    wear::check(top, file)?;
    if let Some(block) = &file.linear {
        linear::check(&top.key("linear"), block)?;
    }
    Ok(())
}
