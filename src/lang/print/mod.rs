//! Model → text, in both languages. What is printed reads back as the same model, to the last digit; comments and the
//! way things were written (loops, parameters, one file or several) are not part of a model and are lost.

mod change;
pub mod fields;
mod kept;
mod lua;
mod monitor;
pub mod scxml;
mod wrap;
mod yaml;

pub use kept::texts as program_texts;
pub use lua::{configurations_lua, coordinator_lua};
pub use monitor::{condition, monitors};
pub use yaml::{configurations_yaml, coordinator_yaml, deployment_yaml};

use crate::diagnostics::Language;
use crate::model::{Configuration, CoordinatorNaming, Deployment, Ident, Statechart};
use kept::KeptFiles;
use std::time::Duration;

/// Configurations in a language; YAML for SCXML, which has no word for them.
pub fn configurations(list: &[Configuration], language: Language) -> String {
    match language {
        Language::Lua => configurations_lua(list),
        // SCXML has no word for configurations.
        Language::Yaml | Language::Scxml => configurations_yaml(list),
    }
}

/// A coordinator in a language.
pub fn coordinator(chart: &Statechart, language: Language) -> String {
    match language {
        Language::Lua => coordinator_lua(chart),
        Language::Yaml => coordinator_yaml(chart),
        Language::Scxml => scxml::coordinator_scxml(chart),
    }
}

/// A deployment as files, by name: itself first (always YAML), then its configurations, its coordinators and its
/// monitors, where it has any, in the language given. A coordinator with functions stays the text that it is, with the files
/// that belong to it.
pub fn deployment(deployment: &Deployment, language: Language) -> Vec<(String, String)> {
    let (ending, other) = match language {
        Language::Lua => ("lua", "lua"),
        Language::Yaml => ("yaml", "yaml"),
        Language::Scxml => ("scxml", "yaml"),
    };
    let kept = KeptFiles::of(deployment);
    let c = format!("configurations.{other}");
    let one = alone(deployment);
    let file = |name: &Ident| match kept.coordinators.get(name) {
        Some(file) => file.clone(),
        None if one => format!("coordinator.{ending}"),
        None => format!("{name}.coordinator.{ending}"),
    };
    let coordinators: Vec<String> = deployment.coordinators.iter().map(|c| file(&c.name)).collect();
    let m = (!deployment.monitors.is_empty()).then(|| format!("monitors.{other}"));
    let main = deployment_yaml(deployment, &[&c], &coordinators, m.as_deref(), &kept.keys);
    let mut files = vec![
        (format!("{}.deployment.yaml", deployment.name), main),
        (c, configurations(&deployment.configurations, language)),
    ];
    for (own, file) in deployment.coordinators.iter().zip(&coordinators) {
        if !kept.coordinators.contains_key(&own.name) {
            files.push((file.clone(), coordinator(&own.chart, language)));
        }
    }
    files.extend(kept.files);
    files.extend(m.map(|m| (m, monitors(&deployment.monitors, language))));
    files
}

/// Whether there is one coordinator, written without a name.
fn alone(deployment: &Deployment) -> bool {
    matches!(&deployment.coordinators[..], [one] if one.written == CoordinatorNaming::Alone)
}

/// The files of the coordinators that have functions, and so stay what they are.
pub fn kept(deployment: &Deployment) -> Vec<(Ident, String)> {
    KeptFiles::of(deployment).coordinators.into_iter().collect()
}

/// A float that reads back as the same float, and as a float in every reader of YAML: with a point.
pub fn float(v: f64) -> String {
    let text = format!("{v:?}");
    match text.split_once('e') {
        Some((mantissa, exponent)) if !mantissa.contains('.') => format!("{mantissa}.0e{exponent}"),
        _ => text,
    }
}

/// A time as a decimal number of units of `10^digits` nanoseconds, exact.
fn decimal(time: Duration, digits: u32) -> String {
    let unit = 10_u128.pow(digits);
    let (whole, rest) = (time.as_nanos() / unit, time.as_nanos() % unit);
    let width = digits as usize;
    let fraction = format!("{rest:0width$}");
    let fraction = fraction.trim_end_matches('0');
    format!("{whole}.{}", if fraction.is_empty() { "0" } else { fraction })
}

/// A time in seconds.
pub fn seconds(time: Duration) -> String {
    decimal(time, 9)
}

/// A time in milliseconds.
pub fn milliseconds(time: Duration) -> String {
    decimal(time, 6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_what_they_are() {
        assert_eq!([float(1.0), float(1e21), float(-0.0), float(1.5e-7)], ["1.0", "1.0e21", "-0.0", "1.5e-7"]);
        assert_eq!(seconds(Duration::from_millis(500)), "0.5");
        assert_eq!(seconds(Duration::from_nanos(86_400_000_000_001)), "86400.000000001");
        assert_eq!(milliseconds(Duration::from_micros(1_500)), "1.5");
        assert_eq!(milliseconds(Duration::from_secs(2)), "2000.0");
    }
}
