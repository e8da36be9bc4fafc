//! The platforms of a program: the built-in ones, and those that it brings itself.

use super::Checked;
use crate::functions::HostFunction;
use crate::lang::schema::{OptionName, PlatformNames, ProgramNames};
use crate::model::codes::{DEPLOY_PLATFORM_OPTION, DEPLOY_UNKNOWN_PLATFORM};
use crate::model::finding::did_you_mean;
use crate::model::{Deployment, Finding, Findings, Ident, PlatformKind, Value, ValueType};
use crate::platform::Platform;
use crate::platform::embedded::EmbeddedPlatform;
use crate::runtime::{Libraries, Library};
use crate::time::Clock;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// What a program brings: component libraries, and platforms to run components on.
///
/// ```
/// use davit::Extensions;
/// // The built-in libraries on the built-in platforms: `davit` itself.
/// let extensions = Extensions::from(davit::builtin());
/// assert_eq!(extensions.platforms().collect::<Vec<_>>(), ["embedded", "simulated"]);
/// ```
#[derive(Debug, Clone)]
pub struct Extensions {
    /// Its component libraries.
    pub libraries: Libraries,
    platforms: Vec<PlatformMaker>,
}

impl From<Libraries> for Extensions {
    fn from(libraries: Libraries) -> Self {
        let built_in = PlatformKind::BUILT_IN.iter().map(|(name, kind)| PlatformMaker {
            name: Ident::new(name).expect("the name of a built-in platform"),
            kind: *kind,
            options: Vec::new(),
            functions: Vec::new(),
            make: if kind.imitates { Make::Simulated } else { Make::Embedded },
        });
        Self { libraries, platforms: built_in.collect() }
    }
}

impl From<&Libraries> for Extensions {
    fn from(libraries: &Libraries) -> Self {
        libraries.clone().into()
    }
}

impl From<&Extensions> for Extensions {
    fn from(extensions: &Extensions) -> Self {
        extensions.clone()
    }
}

impl Extensions {
    /// With one more platform. One of the same name is replaced.
    #[must_use]
    pub fn with_platform(mut self, platform: PlatformMaker) -> Self {
        self.platforms.retain(|other| other.name != platform.name);
        self.platforms.push(platform);
        self
    }

    /// The names of its platforms.
    pub fn platforms(&self) -> impl Iterator<Item = &str> {
        self.platforms.iter().map(|platform| platform.name.as_str())
    }

    /// What its files may name that no file declares, for the schema.
    pub(crate) fn names(&self) -> ProgramNames {
        let option = |option: &PlatformOption| OptionName {
            name: option.name,
            ty: option.ty.clone(),
            required: option.default.is_none(),
            doc: option.doc.clone(),
        };
        let platform =
            |of: &PlatformMaker| PlatformNames { name: of.name, options: of.options.iter().map(option).collect() };
        let types = self.libraries.iter().flat_map(|library| library.kinds());
        ProgramNames {
            platforms: self.platforms.iter().map(platform).collect(),
            libraries: self.libraries.iter().map(Library::name).collect(),
            types: types.map(|kind| kind.ty.name).collect(),
        }
    }

    /// The platform that a deployment names, which then knows its kind and all its options; or why there is none.
    pub(super) fn platform_of(&self, deployment: &mut Deployment) -> Result<PlatformMaker, Findings> {
        let Some(platform) = self.platforms.iter().find(|platform| platform.name == deployment.platform) else {
            let name = deployment.platform;
            let finding = Finding::error(DEPLOY_UNKNOWN_PLATFORM, format!("this program has no platform `{name}`"));
            let help = did_you_mean(name.as_str(), "platforms", self.platforms());
            return Err(vec![finding.at(deployment.key_origin("platform")).path("platform").help(help)]);
        };
        deployment.kind = platform.kind;
        platform.fit(deployment)?;
        Ok(platform.clone())
    }
}

/// A platform of a program: its name, what kind it is, which options a deployment may give it, and how it is made.
///
/// ```
/// use davit::platforms::{PlatformKind, PlatformMaker, Simulated, SimulatedOptions};
/// use davit::{Extensions, ValueType};
/// use std::sync::Arc;
///
/// let bus = PlatformMaker::new("bus", PlatformKind::ELSEWHERE, |making| {
///     // One for a real bus would open `making.options["device"]` here, and say why it cannot.
///     Ok(Arc::new(Simulated::new(making.checked.catalogue.clone(), making.clock.clone(), SimulatedOptions::default())))
/// })
/// .option("device", ValueType::Str, None, "the device file of the bus");
/// // `platform: { bus: { device: "/dev/bus0" } }` in a deployment.
/// let extensions = Extensions::from(davit::builtin()).with_platform(bus);
/// assert!(extensions.platforms().any(|name| name == "bus"));
/// ```
#[derive(Clone)]
pub struct PlatformMaker {
    name: Ident,
    kind: PlatformKind,
    options: Vec<PlatformOption>,
    functions: Vec<PlatformFunction>,
    pub(super) make: Make,
}

/// How a platform is made.
#[derive(Clone)]
pub(super) enum Make {
    Embedded,
    Simulated,
    Own(Arc<MakeOwn>),
}

type MakeOwn = dyn Fn(&Making<'_>) -> Result<Arc<dyn Platform>, String> + Send + Sync;

/// An option of a platform.
#[derive(Debug, Clone)]
struct PlatformOption {
    name: Ident,
    ty: ValueType,
    default: Option<Value>,
    doc: String,
}

/// A function of a platform for coordinators with functions.
#[derive(Clone)]
struct PlatformFunction {
    name: Ident,
    call: Arc<CallPlatform>,
}

type CallPlatform = dyn Fn(&dyn Platform, &Clock, &[Value]) -> Result<Value, String> + Send + Sync;

/// What a platform is made from.
#[derive(Debug)]
pub struct Making<'a> {
    /// The deployment that is to run on it, with what it may use.
    pub checked: &'a Checked,
    /// The clock of everything.
    pub clock: &'a Clock,
    /// The options, each of its type; those that the deployment does not give have their defaults.
    pub options: &'a BTreeMap<Ident, Value>,
}

impl Making<'_> {
    /// The platform on which components of this process run, the built-in `embedded`: for one that is made around it.
    pub fn embedded(&self) -> Arc<dyn Platform> {
        Arc::new(EmbeddedPlatform::new(self.clock, &self.checked.libraries, &self.checked.deployment.activities))
    }
}

impl fmt::Debug for PlatformMaker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PlatformMaker").field("name", &self.name).field("kind", &self.kind).finish_non_exhaustive()
    }
}

impl PlatformMaker {
    /// A platform that deployments name `name`; `make` makes it when one is started, or says why it cannot.
    ///
    /// # Panics
    /// When `name` is no plain name.
    pub fn new(
        name: &str,
        kind: PlatformKind,
        make: impl Fn(&Making<'_>) -> Result<Arc<dyn Platform>, String> + Send + Sync + 'static,
    ) -> Self {
        let name = Ident::new(name).unwrap_or_else(|error| panic!("a platform's name: {error}"));
        Self { name, kind, options: Vec::new(), functions: Vec::new(), make: Make::Own(Arc::new(make)) }
    }

    /// With an option that deployments may give it; one without a default must be given. `doc` is shown to people.
    ///
    /// # Panics
    /// When `name` is no plain name, or the default is not of the type.
    #[must_use]
    pub fn option(mut self, name: &str, ty: ValueType, default: Option<Value>, doc: &str) -> Self {
        let name = Ident::new(name).unwrap_or_else(|error| panic!("a platform's option: {error}"));
        let default = default.map(|v| v.fit(&ty).unwrap_or_else(|error| panic!("the default of `{name}`: {error}")));
        self.options.push(PlatformOption { name, ty, default, doc: doc.to_owned() });
        self
    }

    /// With a function that coordinators with functions of a deployment on this platform find as a global, as an rFSM model finds what its
    /// program gives it. Its error is one of Lua's.
    ///
    /// It is called in the coordinator's own thread, which reacts to nothing until it returns. What it does to components is done
    /// behind the configurator's back: no claim keeps it out, no undo takes it back. No built-in platform has any.
    ///
    /// # Panics
    /// When `name` is no plain name.
    #[must_use]
    pub fn function(
        mut self,
        name: &str,
        call: impl Fn(&dyn Platform, &Clock, &[Value]) -> Result<Value, String> + Send + Sync + 'static,
    ) -> Self {
        let name = Ident::new(name).unwrap_or_else(|error| panic!("a platform's function: {error}"));
        self.functions.push(PlatformFunction { name, call: Arc::new(call) });
        self
    }

    /// Its functions, of one that was made.
    pub(super) fn functions_of(&self, platform: &Arc<dyn Platform>, clock: &Clock) -> Vec<HostFunction> {
        let one = |function: &PlatformFunction| {
            let (call, platform, clock) = (function.call.clone(), platform.clone(), clock.clone());
            HostFunction { name: function.name, call: Arc::new(move |values| call(&*platform, &clock, values)) }
        };
        self.functions.iter().map(one).collect()
    }

    /// Gives each option its value of the right type, or says what is wrong with those of the deployment.
    fn fit(&self, deployment: &mut Deployment) -> Result<(), Findings> {
        let mut findings = Findings::new();
        let mut given = std::mem::take(&mut deployment.platform_options);
        let at = |deployment: &Deployment, option: Ident| {
            let path = format!("platform.{}.{option}", self.name);
            (deployment.key_origin(&path), path)
        };
        for option in &self.options {
            let (origin, path) = at(deployment, option.name);
            let wrong = |message: String, help: String| {
                Finding::error(DEPLOY_PLATFORM_OPTION, message).at(origin).path(path).help(help)
            };
            let value = match (given.remove(&option.name), &option.default) {
                (Some(value), _) => match value.fit(&option.ty) {
                    Ok(value) => value,
                    Err(error) => {
                        let message = format!("`{}` of the platform `{}`: {error}", option.name, self.name);
                        findings.push(wrong(message, format!("it is {}: {}", option.ty, option.doc)));
                        continue;
                    }
                },
                (None, Some(default)) => default.clone(),
                (None, None) => {
                    let message = format!("the platform `{}` needs `{}`: {}", self.name, option.name, option.doc);
                    let help = format!("write `platform: {{ {}: {{ {}: … }} }}`", self.name, option.name);
                    findings.push(wrong(message, help));
                    continue;
                }
            };
            deployment.platform_options.insert(option.name, value);
        }
        for unknown in given.into_keys() {
            let (origin, path) = at(deployment, unknown);
            let help =
                did_you_mean(unknown.as_str(), "options", self.options.iter().map(|option| option.name.as_str()));
            let message = format!("the platform `{}` has no option `{unknown}`", self.name);
            findings.push(Finding::error(DEPLOY_PLATFORM_OPTION, message).at(origin).path(path).help(help));
        }
        if findings.is_empty() { Ok(()) } else { Err(findings) }
    }
}
