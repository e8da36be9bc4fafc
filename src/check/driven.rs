//! What drives in-ports, by the text of the configurations that may be in force: those that a coordinator asks for, and those that an
//! operator may apply at any time. One that nobody may ask for drives nothing.

use super::coupling;
use super::links::links;
use crate::model::{
    ChangeKind, ComponentName, ConfigId, Configuration, Deployment, MemberRef, OperatorMay, Origin, TypeName,
};
use crate::statechart::Chart;
use rustc_hash::FxHashSet;

/// A configuration that drives an in-port, and never while the deployment is up.
#[derive(Debug, Clone, Copy)]
pub struct DrivesInVain {
    /// Its name.
    pub id: ConfigId,
    /// Where it does.
    pub at: Origin,
    /// Whether anybody asks for it.
    pub asked: bool,
}

/// In-ports by who may drive them.
pub struct DrivenPorts<'d> {
    deployment: &'d Deployment,
    /// Configurations that may be in force.
    counts: FxHashSet<ConfigId>,
    /// What an operator may drive, or a parent, whatever coordinators do.
    anytime: FxHashSet<MemberRef>,
    /// The same with what coordinators ask for.
    some_time: FxHashSet<MemberRef>,
    /// What any configuration drives.
    written: FxHashSet<MemberRef>,
    /// Components that configurations make that may be in force, and as what.
    made: FxHashSet<(ComponentName, TypeName)>,
}

impl<'d> DrivenPorts<'d> {
    /// `charts`: the coordinators; none: they are not all known. What is not known, and what functions raise, may be anything.
    pub fn new(deployment: &'d Deployment, charts: Option<&[&Chart]>) -> Self {
        let all = || deployment.configurations.iter();
        let operated = coupling::by_operator(deployment);
        let counts: FxHashSet<ConfigId> = match charts.filter(|charts| charts.iter().all(|chart| chart.is_pure())) {
            Some(charts) => {
                let asked = charts.iter().flat_map(|chart| coupling::asked(deployment, chart));
                // What a subsystem exports is there without being asked for.
                let given = deployment.subsystems.iter().map(|subsystem| ConfigId::from(subsystem.name));
                asked.chain(given).chain(operated.iter().copied()).collect()
            }
            None => all().map(|configuration| configuration.id).collect(),
        };
        let set = deployment.operator.iter().filter_map(|(may, _)| match may {
            OperatorMay::Set(member) => Some(*member),
            OperatorMay::Apply(_) => None,
        });
        // What is exported is the parent's to drive.
        let exported = deployment.interface.exports.values().map(|export| export.of);
        let by_operator = driven_by(all().filter(|configuration| operated.contains(&configuration.id)));
        let anytime: FxHashSet<MemberRef> = by_operator.into_iter().chain(set).chain(exported).collect();
        let counting = || all().filter(|configuration| counts.contains(&configuration.id));
        let makes =
            counting().flat_map(|configuration| &configuration.changes).filter_map(|change| change.kind.makes());
        Self {
            made: makes.map(|(component, ty, _)| (component, ty)).collect(),
            some_time: driven_by(counting()).into_iter().chain(anytime.iter().copied()).collect(),
            written: driven_by(all()).into_iter().chain(anytime.iter().copied()).collect(),
            deployment,
            counts,
            anytime,
        }
    }

    /// Whether something may drive an in-port of a component of that type. What nobody may ask for is judged as it is written.
    pub fn drives(&self, port: MemberRef, ty: TypeName) -> bool {
        match self.made.contains(&(port.component, ty)) {
            true => self.some_time.contains(&port),
            false => self.written.contains(&port),
        }
    }

    /// In-ports that only coordinators drive: whether they do while the deployment is up is known when they were followed.
    pub fn by_coordinators(&self) -> Vec<MemberRef> {
        self.some_time.iter().filter(|port| !self.anytime.contains(*port)).copied().collect()
    }

    /// Of these it is known now that they do not.
    pub fn forget(&mut self, undriven: &FxHashSet<MemberRef>) {
        self.some_time.retain(|port| !undriven.contains(port));
    }

    /// Of an in-port that nothing drives while the deployment is up: the first configuration that does otherwise, or would.
    pub fn in_vain(&self, port: MemberRef) -> Option<DrivesInVain> {
        let drives = |kind: &ChangeKind| match kind {
            ChangeKind::Connect { to, .. } => *to == port,
            ChangeKind::PortWrite { port: written, .. } => *written == port,
            _ => false,
        };
        self.deployment.configurations.iter().find_map(|configuration| {
            let change = configuration.changes.iter().find(|change| drives(&change.kind))?;
            let asked = self.counts.contains(&configuration.id);
            Some(DrivesInVain { id: configuration.id, at: change.origin, asked })
        })
    }
}

/// What these connect or write.
pub fn driven_by<'d>(configurations: impl Iterator<Item = &'d Configuration> + Clone) -> FxHashSet<MemberRef> {
    let changes = configurations.clone().flat_map(|configuration| &configuration.changes);
    let written = changes.filter_map(|change| match &change.kind {
        ChangeKind::PortWrite { port, .. } => Some(*port),
        _ => None,
    });
    links(configurations).into_iter().map(|(_, to)| to).chain(written).collect()
}
