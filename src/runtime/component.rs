//! What a component is: a Rust type with ports, properties and operations, updated by an activity.

use super::beat::Beat;
use super::builder::Builder;
use super::call::{CallProgress, Reply, Responder};
use super::value::PortValue;
use crate::model::{ComponentName, EventName, Value, ValueType};
use crate::time::{Clock, Time};
use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A component type, written in Rust.
///
/// ```
/// use davit::component::{Builder, Component, Context, In, Library, Out, Prop};
///
/// struct Scale { u: In<f64>, y: Out<f64>, k: Prop<f64> }
///
/// impl Component for Scale {
///     fn new(b: &mut Builder<Self>) -> Self {
///         b.describe("Multiplies.");
///         Self {
///             u: b.doc("What comes in.").unit("N").input("u"),
///             y: b.doc("`k` times what comes in.").unit("N").output("y"),
///             k: b.doc("The factor.").range(0.0..=10.0).property("k", 1.0),
///         }
///     }
///
///     fn update(&mut self, _: &mut Context) {
///         if let Some(u) = self.u.get() {
///             let k = self.k.get();
///             self.y.write(k * u);
///         }
///     }
/// }
///
/// let library = Library::new("mine").with::<Scale>("Scale");
/// assert_eq!(library.catalogue().iter().next().unwrap().properties.len(), 1);
/// ```
///
/// All time goes through [`Context::clock`]. A component that reads another clock, or waits otherwise, cannot be simulated.
pub trait Component: Send + Sized + 'static {
    /// Declares ports, properties, operations and hooks, and makes a component that has them.
    ///
    /// It is also called to describe the type, when nothing is meant to run: it must declare the same members at every
    /// call, and do nothing but declare and initialise. Devices are opened by the configure hook.
    fn new(b: &mut Builder<Self>) -> Self;

    /// One step of the running component, called by its activity: in every period, or when something came.
    fn update(&mut self, cx: &mut Context) {
        let _ = cx;
    }
}

/// Why a hook or an operation failed, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure(pub String);

impl<T: Into<String>> From<T> for Failure {
    fn from(text: T) -> Self {
        Self(text.into())
    }
}

impl Failure {
    /// The failure that an error means.
    pub fn from_error(error: &dyn std::error::Error) -> Self {
        Self(error.to_string())
    }
}

/// What a hook answers. A failed hook means that the run state does not change.
pub type HookResult = Result<(), Failure>;

/// What an operation answers.
#[derive(Debug, Clone, PartialEq)]
pub enum OperationAnswer<R = ()> {
    /// Done, with its result.
    Done(R),
    /// Not done, and nothing changed.
    Failed(String),
    /// Under way: a [`Ticket`] taken from the context answers in a later update.
    Pending,
}

impl<R> OperationAnswer<R> {
    /// Not done.
    pub fn failed(text: impl Into<String>) -> Self {
        Self::Failed(text.into())
    }
}

impl<R> From<Result<R, Failure>> for OperationAnswer<R> {
    fn from(result: Result<R, Failure>) -> Self {
        match result {
            Ok(value) => Self::Done(value),
            Err(failure) => Self::Failed(failure.0),
        }
    }
}

/// What an operation may return: nothing, or a value of the model.
pub trait Returned: Send + 'static {
    /// Its type in the model, if it is a value.
    fn value_type() -> Option<ValueType>;
    /// The value.
    fn into_value(self) -> Option<Value>;
}

impl Returned for () {
    fn value_type() -> Option<ValueType> {
        None
    }
    fn into_value(self) -> Option<Value> {
        None
    }
}

impl<T: PortValue> Returned for T {
    fn value_type() -> Option<ValueType> {
        Some(T::value_type())
    }
    fn into_value(self) -> Option<Value> {
        Some(self.to_value())
    }
}

/// The arguments of an operation: a tuple of up to six values.
pub trait Arguments: Sized + 'static {
    /// Their types in the model.
    fn types() -> Vec<ValueType>;
    /// The arguments; none when they do not fit.
    fn from_values(values: &[Value]) -> Option<Self>;
}

macro_rules! arguments {
    ($(($($name:ident),*))*) => {$(
        impl<$($name: PortValue),*> Arguments for ($($name,)*) {
            fn types() -> Vec<ValueType> {
                vec![$($name::value_type()),*]
            }
            #[allow(non_snake_case)]
            fn from_values(values: &[Value]) -> Option<Self> {
                match values {
                    [$($name),*] => Some(($($name::from_value($name)?,)*)),
                    _ => None,
                }
            }
        }
    )*};
}
arguments! { () (A) (A, B) (A, B, C) (A, B, C, D) (A, B, C, D, E) (A, B, C, D, E, F) }

/// The answer to a call that takes longer than one update. Dropped unanswered, the call failed.
///
/// A call can be given up while it is under way: its deadline is past, or nobody wants it any more. Look at
/// [`Ticket::is_cancelled`] in each update; when it says so, come to rest (what moves, holds where it is) and drop the
/// ticket. Until then the component begins no other operation; see `Platform::cancel` for what the call then counts as.
pub struct Ticket<R = ()> {
    call: Option<Responder>,
    returned: PhantomData<fn(R)>,
}

impl<R: Returned> Ticket<R> {
    /// The operation is done.
    pub fn done(mut self, value: R) {
        self.answer(Reply::Done(value.into_value()));
    }

    /// The operation failed.
    pub fn failed(mut self, text: impl Into<String>) {
        self.answer(Reply::Failed(text.into()));
    }
}

impl<R> Ticket<R> {
    /// Whether the call has been given up: come to rest.
    pub fn is_cancelled(&self) -> bool {
        self.call.as_ref().is_none_or(|call| call.0.is_told())
    }

    fn answer(&mut self, reply: Reply) {
        if let Some(call) = self.call.take() {
            call.0.answer(reply);
        }
    }
}

impl<R> Drop for Ticket<R> {
    fn drop(&mut self) {
        self.answer(Reply::Failed("the component dropped the call".to_owned()));
    }
}

/// What a component may ask for and do while it is called.
pub struct Context<'a> {
    clock: &'a Clock,
    beat: &'a Arc<Beat>,
    dt: f64,
    period: f64,
    first: bool,
    pub(crate) fault: Option<String>,
    /// Whether it has failed: asked of a call of an operation.
    faulted: bool,
    call: Option<Responder>,
    /// The call that this is, if it is one of an operation.
    progress: Option<Arc<CallProgress>>,
}

impl<'a> Context<'a> {
    #[inline]
    pub(crate) fn new(clock: &'a Clock, beat: &'a Arc<Beat>) -> Self {
        Self {
            clock,
            beat,
            dt: 0.0,
            period: 0.0,
            first: false,
            fault: None,
            faulted: false,
            call: None,
            progress: None,
        }
    }

    /// Of an update: `dt` seconds after the last one, none: it is the first.
    #[inline]
    pub(crate) fn of_update(clock: &'a Clock, beat: &'a Arc<Beat>, dt: Option<f64>, period: f64) -> Self {
        Self { dt: dt.unwrap_or(period), period, first: dt.is_none(), ..Self::new(clock, beat) }
    }

    /// Of the call of an operation. `faulted`: the component has failed before.
    pub(crate) fn of_call(clock: &'a Clock, beat: &'a Arc<Beat>, call: Responder, faulted: bool) -> Self {
        let progress = Some(call.0.clone());
        Self { call: Some(call), faulted, progress, ..Self::new(clock, beat) }
    }

    /// The answering end, unless a ticket has it.
    pub(crate) fn take_call(&mut self) -> Option<Responder> {
        self.call.take()
    }

    /// The moment this call stands for: the same in all of one update, and the time stamp of what it writes.
    pub fn now(&self) -> Time {
        self.beat.now()
    }

    /// Seconds since the last update of this component. In a periodic activity a whole number of periods (one, unless
    /// periods were missed), also at the first update after a start; in an event-driven one the time between the two
    /// updates' moments, 0 at the first.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Seconds between two updates where none is missed: the period of a periodic activity; 0 in an event-driven one, and where this is no
    /// update.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Whether this is the first update since the component was started.
    pub fn is_first(&self) -> bool {
        self.first
    }

    /// The clock.
    pub fn clock(&self) -> &Clock {
        self.clock
    }

    /// The component's name.
    pub fn name(&self) -> ComponentName {
        self.beat.name
    }

    /// Raises an event in the component's name; without an event port it goes to the coordinator only.
    pub fn raise(&mut self, event: EventName) {
        self.beat.raise(event);
    }

    /// Says that the component cannot go on: after this call it is faulted.
    pub fn fault(&mut self, reason: impl Into<String>) {
        self.fault = Some(reason.into());
    }

    /// In an event-driven activity: update me at `time` though nothing may have come. The last call counts.
    pub fn wake_at(&mut self, time: Time) {
        self.beat.wake_at.store(time.0, Ordering::Relaxed);
    }

    /// Inside an operation: whether its caller has given it up. One that waits or works for long looks at it now and then,
    /// and when it says so comes to rest and returns, whatever it answers: an error then counts as done half way. What
    /// answers later looks at [`Ticket::is_cancelled`] instead. In hooks and updates always false: they cannot be given up.
    pub fn is_cancelled(&self) -> bool {
        self.progress.as_ref().is_some_and(|progress| progress.is_told())
    }

    /// Inside an operation: whether the component has failed before, and is not updated any more. What it answers then is not done by anybody: who
    /// drives something refuses.
    pub fn is_faulted(&self) -> bool {
        self.faulted
    }

    /// Inside an operation: the means to answer later. The operation then answers [`OperationAnswer::Pending`].
    pub fn ticket<R: Returned>(&mut self) -> Ticket<R> {
        Ticket { call: self.call.take(), returned: PhantomData }
    }
}
