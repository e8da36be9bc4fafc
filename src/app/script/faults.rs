//! `fault(step, how, times)`: what a script lets go wrong on the simulated platform, before a deployment and while it is up.

use super::error;
use crate::app::Checked;
use crate::app::start::rule;
use crate::check;
use crate::limits;
use crate::model::finding::{did_you_mean, did_you_mean_path};
use crate::model::{ComponentName, ComponentType, Direction, FaultKind, Ident, Origin, StepFault, TypeName};
use crate::platform::simulated::Simulated;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

/// What a script lets go wrong.
#[derive(Default)]
pub(super) struct ScriptFaults {
    /// For the next deployment.
    waiting: Vec<StepFault>,
    /// What is up, with the platform it runs on, if that is the simulated one.
    up: Option<(Checked, Option<Simulated>)>,
}

impl ScriptFaults {
    /// From now on this goes wrong; without a deployment, from the beginning of the next one.
    pub(super) fn add(&mut self, step: &str, how: &str, times: Option<f64>, takes: Option<f64>) -> mlua::Result<()> {
        // One blank between words, as steps are printed.
        let step = step.split_whitespace().collect::<Vec<_>>().join(" ");
        let kind = FaultKind::WORDS.iter().find(|(word, _)| *word == how);
        let how = kind.map(|(_, kind)| *kind).ok_or_else(|| {
            let help = did_you_mean(how, "kinds of fault", FaultKind::WORDS.iter().map(|(word, _)| *word));
            error(format!("`{how}` is no kind of fault: {help}"))
        })?;
        let takes = match (how, takes) {
            (FaultKind::Slow, Some(takes)) if (0.0..=1e6).contains(&takes) => Duration::from_secs_f64(takes),
            (FaultKind::Slow, Some(takes)) => {
                return Err(error(format!("{takes} is not a number of seconds from 0 to 1000000")));
            }
            (FaultKind::Slow, None) => {
                return Err(error(
                    "how long does it take? Write it like fault(\"start a\", \"slow\", 1, 0.5), in seconds",
                ));
            }
            (_, Some(_)) => return Err(error("only what is \"slow\" takes time")),
            (_, None) => Duration::ZERO,
        };
        let fault = StepFault { step, how, times: whole(times.unwrap_or(1.0))?, takes, origin: Origin::NONE };
        match &self.up {
            None => self.waiting.push(fault),
            Some((checked, simulated)) => {
                fits(&fault, checked)?;
                if let Some(simulated) = simulated {
                    simulated.add_fault(rule(&fault));
                }
            }
        }
        Ok(())
    }

    /// A component of the deployment that is up fails by itself.
    pub(super) fn fail(&self, component: &str) -> mlua::Result<()> {
        let Some((checked, Some(simulated))) = &self.up else {
            return Err(error(
                "only components of the simulated platform fail when they are told to: run the script with `--platform \
                 simulated`",
            ));
        };
        let name = ComponentName::new(component).ok();
        if name.is_some_and(|name| simulated.fault(name, "the script lets it fail")) {
            return Ok(());
        }
        let created = checked.deployment.configurations.iter().flat_map(|c| &c.changes).filter_map(|c| c.kind.makes());
        let known: BTreeSet<ComponentName> = created.map(|(component, ..)| component).collect();
        if name.is_some_and(|name| known.contains(&name)) {
            return Err(error(format!("`{component}` is not there now, and cannot fail")));
        }
        let help = did_you_mean_path(component, "components", known.iter().map(ComponentName::as_str));
        Err(error(format!("there is no component `{component}`: {help}")))
    }

    /// Whether what waits for this deployment can go wrong in it.
    pub(super) fn fit(&self, checked: &Checked) -> mlua::Result<()> {
        self.waiting.iter().try_for_each(|fault| fits(fault, checked))
    }

    /// The ports of one direction of the components of a type, as the deployment that is up has it.
    pub(super) fn ports(&self, ty: TypeName, direction: Direction) -> Vec<Ident> {
        let known = self.up.as_ref().and_then(|(checked, _)| checked.catalogue.get(ty));
        let ports = known.iter().flat_map(|ty| &ty.ports);
        ports.filter(|(_, port)| port.direction == direction).map(|(name, _)| *name).collect()
    }

    /// Whether the components of the deployment that is up are imitated, and do nothing by themselves.
    pub(super) fn imitated(&self) -> bool {
        self.up.as_ref().is_some_and(|(checked, _)| checked.deployment.kind.imitates)
    }

    /// The components that configurations of the deployment that is up create, each with its type, or types.
    pub(super) fn created(&self) -> Vec<(ComponentName, Arc<ComponentType>)> {
        let Some((checked, _)) = &self.up else { return Vec::new() };
        let changes = checked.deployment.configurations.iter().flat_map(|c| &c.changes);
        let made = changes.filter_map(|change| change.kind.makes());
        let typed = made.filter_map(|(component, ty, _)| Some((component, checked.catalogue.get(ty)?.clone())));
        typed.collect()
    }

    /// A deployment is about to be brought up; what waited for it is in force.
    pub(super) fn up(&mut self, checked: Checked, simulated: Option<Simulated>) {
        if let Some(simulated) = &simulated {
            self.waiting.drain(..).for_each(|fault| simulated.add_fault(rule(&fault)));
        }
        self.up = Some((checked, simulated));
    }

    /// It has been taken down, and its faults with it.
    pub(super) fn down(&mut self) {
        self.up = None;
    }
}

fn whole(times: f64) -> mlua::Result<u32> {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let number = times as u32;
    if f64::from(number).to_bits() != times.to_bits() || !(1..=limits::FAULT_TIMES).contains(&number) {
        return Err(error(format!(
            "{times} is not a number of times: a whole number from 1 to {}",
            limits::FAULT_TIMES
        )));
    }
    Ok(number)
}

/// Whether the fault can happen in the deployment.
fn fits(fault: &StepFault, checked: &Checked) -> mlua::Result<()> {
    let (deployment, step) = (&*checked.deployment, &fault.step);
    if !deployment.kind.imitates {
        return Err(error(format!(
            "fault \"{step}\": the platform is `{}`, and only the simulated one does wrong what it is told to: run the \
             script with `--platform simulated`",
            deployment.platform
        )));
    }
    match check::fault(fault, deployment, &checked.catalogue).into_iter().next() {
        None => Ok(()),
        Some(finding) => Err(error(format!("fault \"{step}\": {}", finding.in_a_line()))),
    }
}
