//! Alternatives (`group`) of which there is only one: its group's name is misspelt, as it seems.

use crate::model::codes::CONF_ALONE_IN_GROUP;
use crate::model::finding::nearest;
use crate::model::{Configuration, Deployment, Finding, Findings, Ident};

/// Who is alone in its group, where another group has nearly that name.
pub fn check(deployment: &Deployment) -> Findings {
    let of = |group: Ident| deployment.configurations.iter().filter(move |c| c.group == Some(group));
    let found = deployment.configurations.iter().filter_map(|configuration| {
        let group = configuration.group.filter(|group| of(*group).count() == 1)?;
        let others = || deployment.configurations.iter().filter_map(|c| c.group).filter(|other| *other != group);
        let near = nearest(group.as_str(), others().map(|other| other.as_str()))?;
        let other = of(others().find(|other| other.as_str() == near)?).next()?;
        Some(finding(configuration, group, near, other))
    });
    found.collect()
}

fn finding(alone: &Configuration, group: Ident, near: &str, other: &Configuration) -> Finding {
    let message = format!("only `{}` is of the group `{group}`, so it replaces nothing", alone.id);
    Finding::info(CONF_ALONE_IN_GROUP, message)
        .at(alone.origin)
        .also(other.origin, format!("`{}` is of the group `{near}`", other.id))
        .path(format!("configurations.{}.group", alone.id))
        .help(format!("did you mean `{near}`? Else leave it out"))
}
