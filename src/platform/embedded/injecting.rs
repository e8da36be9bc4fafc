//! Faults that are put straight into a component, at any moment: as what is asked of it, they go in between two updates, and
//! wait for no call that was given up.

use super::Inner;
use super::steps::{Naps, opened};
use crate::model::{ComponentName, Ident, Injection, RunState, Value};
use crate::platform::Cause;
use crate::runtime::activity::OperationJob;
use crate::runtime::call::{CallProgress, Reply, Responder};
use crate::runtime::cell::{Cell, CellGuard, CellRequest};
use crate::runtime::gate::Closed;
use crate::time::{Time, lock};
use std::sync::Arc;

impl Inner {
    /// Has it happen; returns when it has, at most by the deadline.
    pub(super) fn inject(&self, name: ComponentName, injection: &Injection, deadline: Time) -> Result<(), String> {
        let (reply, replied) = self.clock.channel(1);
        let call = Responder(Arc::new(CallProgress::new(reply, None, None)));
        let (cell, requests, activity) = {
            let registry = lock(&self.registry);
            let slot = registry.find(name).map_err(|cause| cause.to_string())?;
            let entry = registry.entry(slot);
            if let Injection::Hang { operation: Some(operation) } | Injection::Stall { operation: Some(operation), .. } =
                injection
                && entry.caller(*operation).is_some()
            {
                let beside = format!("`{operation}` runs beside `{name}`, in the thread of who calls it");
                return Err(format!("{beside}: it cannot be held up"));
            }
            let scheduled = registry.activity_of(slot);
            (entry.cell.clone(), scheduled.requests.clone(), scheduled.activity.clone())
        };
        let Some(asked) = asked(&cell, injection)? else { return Ok(()) };
        // Who is inside a component that does not run is waited for, and it may run then.
        let mut naps = Naps::default();
        let inside = loop {
            if cell.state() == RunState::Running {
                break None;
            }
            match CellGuard::idle(&*cell, true, |_| true) {
                Ok(inside) => break Some(inside),
                Err(Closed::Busy | Closed::State(RunState::Running)) if naps.take(&self.clock, deadline) => {}
                Err(why) => {
                    let refused: Result<(), Cause> = opened(Ok(Err(why)), (name, "inject anything into"));
                    return refused.map_err(|cause| cause.to_string());
                }
            }
        };
        match inside {
            None => {
                let job = OperationJob { cell: cell.clone(), asked, call, safe: true };
                requests.try_send(job).map_err(|_| format!("too much waits for the activity `{}`", activity.name))?;
                activity.signal.notify();
            }
            Some(inside) => {
                self.operate_idle(inside, &cell, asked, call).map_err(|cause| cause.to_string())?;
            }
        }
        match replied.recv_deadline(deadline) {
            Ok(Reply::Done(_) | Reply::HalfWay) => Ok(()),
            Ok(Reply::Failed(text) | Reply::Refused(text) | Reply::Panicked(text)) => Err(text),
            Ok(Reply::Withdrawn) | Err(_) => Err(format!("`{name}` did not take it up: its code is busy, or hangs")),
        }
    }
}

/// What is to be asked of the component; none: it was enough to set a trap.
fn asked(cell: &Cell, injection: &Injection) -> Result<Option<CellRequest>, String> {
    let trap = |operation: &Ident, time| {
        let index = cell.kind.operations.binary_search(operation);
        cell.trap(index.map_err(|_| format!("`{}` has no operation `{operation}`", cell.name))?, time);
        Ok(None)
    };
    Ok(Some(match injection {
        Injection::Hang { operation: None } => CellRequest::Hang,
        Injection::Panic => CellRequest::Panic,
        Injection::Stall { time, operation: None } => CellRequest::Stall(*time),
        Injection::Stall { time, operation: Some(operation) } => return trap(operation, Some(*time)),
        Injection::Hang { operation: Some(operation) } => return trap(operation, None),
        Injection::Declared { name, values, .. } => {
            let declared = cell.kind.ty.injections.iter().enumerate().find(|(_, (known, _))| *known == name);
            let (index, (_, declared)) =
                declared.ok_or_else(|| format!("nothing called `{name}` can be injected into `{}`", cell.name))?;
            let fits = |value: &Value, at: usize| declared.parameters.get(at).is_some_and(|p| value.is_of(&p.ty));
            if values.len() != declared.parameters.len()
                || !values.iter().enumerate().all(|(at, value)| fits(value, at))
            {
                return Err(format!("the parameters do not fit `{name}` of `{}`", cell.name));
            }
            CellRequest::Injection(index, values.clone())
        }
    }))
}
