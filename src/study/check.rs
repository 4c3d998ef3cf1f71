//! Every case's scene, before the first of them runs.

use std::collections::HashMap;
use std::path::Path;

use rayon::prelude::*;

use super::quantity::known;
use super::{Case, Study};
use crate::expression::closest;
use crate::scene::findings::{Findings, Span};
use crate::scene::{Scene, SceneError, SceneErrors};
use crate::simulation::fitting_setup;

/// A case whose scene can be run.
#[derive(Debug, Clone)]
pub struct ReadyCase {
    /// The case.
    pub case: Case,
    /// Its scene.
    pub scene: Scene,
    /// Memory that a run of it is expected to take, bytes.
    pub memory: f64,
}

/// What looking at one case gave: its scene with the memory for it, and what its report will tell.
type Looked = (Result<(Scene, f64), SceneErrors>, Vec<String>);

impl Study {
    /// Lets a case that alone would need more memory than this, bytes, be refused before anything of it is made; `None` for
    /// no limit, as at first. See [`Scene::limit_memory`].
    pub fn limit_memory(&mut self, limit: Option<u64>) {
        self.memory = limit;
    }

    /// Reads the scenes of some cases, makes their particles and applies their selectors, on the present rayon pool.
    ///
    /// # Errors
    /// All mistakes found, and cases that need too much memory; those of an override have the place where the study gives
    /// its value.
    pub fn ready(&self, chosen: &[Case]) -> Result<Vec<ReadyCase>, SceneErrors> {
        let mut findings = Findings::new(&self.source);
        let text = match std::fs::read(&self.scene).map(String::from_utf8) {
            Ok(Ok(text)) => text,
            failure => {
                let reason = match failure {
                    Err(error) => error.to_string(),
                    Ok(_) => "it is not UTF-8 text".to_owned(),
                };
                let message = format!("the scene {} cannot be read: {reason}", self.scene.display());
                findings.error(
                    self.scene_span.clone(),
                    message,
                    "correct `scene`, a path from the folder of the study",
                );
                findings.finish()?;
                return Err(SceneErrors::default());
            }
        };
        let looked: Vec<Looked> = chosen.par_iter().map(|case| self.look(case, &text)).collect();
        self.explain(chosen, &looked, &mut findings);
        if let (Some(convergence), Some((Ok(_), names))) = (&self.convergence, looked.first()) {
            for (path, span) in convergence.quantities.iter().zip(&convergence.quantity_spans) {
                if !names.contains(path) {
                    findings.error(span.clone(), format!("the report has no number `{path}`"), remedy(path, names));
                }
            }
        }
        findings.finish()?;
        let scenes = looked.into_iter().filter_map(|(scene, _)| scene.ok());
        let ready = |(case, (scene, memory))| ReadyCase { case, scene, memory };
        Ok(chosen.iter().cloned().zip(scenes).map(ready).collect())
    }

    /// Reads one scene and sets it up, if there is the memory for it.
    fn look(&self, case: &Case, text: &str) -> Looked {
        let name = self.scene.display().to_string();
        let base = self.scene.parent().unwrap_or(Path::new(""));
        let mut scene = match Scene::parse(text, &name, base, &case.overrides()) {
            Ok(scene) => scene,
            Err(errors) => return (Err(errors), Vec::new()),
        };
        scene.limit_memory(self.memory);
        let looked = match scene.dimension() {
            1 => fitting_setup::<1>(&scene).map(|fitting| (known(&fitting.setup), fitting.memory)),
            2 => fitting_setup::<2>(&scene).map(|fitting| (known(&fitting.setup), fitting.memory)),
            _ => fitting_setup::<3>(&scene).map(|fitting| (known(&fitting.setup), fitting.memory)),
        };
        match looked {
            Ok((names, memory)) => (Ok((scene, memory)), names),
            Err(errors) => (Err(errors), Vec::new()),
        }
    }

    /// Notes the mistakes of all cases, each once.
    fn explain(&self, chosen: &[Case], looked: &[Looked], findings: &mut Findings<'_>) {
        type Occurrences<'c> = Vec<(Option<Span>, &'c Case, &'c SceneError)>;
        let mut noted: HashMap<(String, String), Occurrences<'_>> = HashMap::new();
        let mut order = Vec::new();
        for (case, (result, _)) in chosen.iter().zip(looked) {
            for error in result.as_ref().err().into_iter().flatten() {
                let place = self.place(case, error);
                let name = place.as_ref().map_or_else(|| error.location(), |span| format!("{span:?}"));
                let key = (name, error.message.clone());
                if !noted.contains_key(&key) {
                    order.push(key.clone());
                }
                noted.entry(key).or_default().push((place, case, error));
            }
        }
        for key in order {
            let Some(found) = noted.get(&key) else { continue };
            let (place, case, error) = &found[0];
            // What every case has is a mistake of the scene itself.
            let which = match found.len() == looked.len() || case.varied().is_empty() {
                true => String::new(),
                false => format!(" (case {}: {})", case.index, case.label()),
            };
            let message = format!("{}{which}", error.message);
            match place {
                Some(span) => findings.error(span.clone(), message, error.remedy.clone()),
                None => findings.elsewhere(self.scene_span.clone(), SceneError { message, ..(*error).clone() }),
            }
        }
    }

    /// Where the study has what is wrong with an override.
    fn place(&self, case: &Case, error: &SceneError) -> Option<Span> {
        let wrong = error.origin.strip_prefix("--set ")?;
        let one = case.assignments.iter().find(|one| wrong == format!("{}={}", one.key, one.value))?;
        let column = error.column? - 1;
        let length = one.key.chars().count();
        if column < length {
            return Some(one.key_span.clone());
        }
        let (span, inside) = (one.value_span.clone(), column.saturating_sub(length + 1));
        // Values that stand in the study as they are overridden can be pointed into.
        let same = one.value.is_ascii() && self.source.slice(&span) == Some(one.value.as_str());
        let part = span.start + inside..(span.start + inside + error.length).min(span.end);
        Some(if same && !part.is_empty() { part } else { span })
    }
}

fn remedy(path: &str, names: &[String]) -> String {
    let near = closest(path, names.iter().map(String::as_str)).map(|near| format!("did you mean `{near}`? "));
    let measured: Vec<&str> = names
        .iter()
        .map(String::as_str)
        .filter(|name| name.starts_with("errors.") || name.starts_with("probes."))
        .collect();
    let list = match measured.is_empty() {
        true => {
            "it has neither an exact solution nor probes: give it one, or name another number of report.json".to_owned()
        }
        false => format!("there are {}, and the other numbers of report.json", measured.join(", ")),
    };
    format!("{}{list}", near.unwrap_or_default())
}
