//! Names, each kind its own type.
//!
//! Every name is interned ([`ustr`]): copying, comparing and hashing one costs as much as a pointer, which is what lets a
//! plan touch thousands of components without an allocation per name. Interned text is never freed; the text a
//! deployment may bring in is bounded (see [`crate::limits`]), and so is what it can intern.
//!
//! Grammar (semantics: *Words*): a plain name is `[A-Za-z_][A-Za-z0-9_]*`; subsystems are separated by `/`, a member by `.`:
//! `left/Dynamics.force_gain`.

use super::value::Value;
use super::words::sent_as_shown;
use std::fmt;
use ustr::Ustr;

/// Why a text is not a name of the wanted kind.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not {} {kind}: {reason}", self.article())]
pub struct NameError {
    /// The refused text.
    pub text: String,
    /// The kind of name that was wanted.
    pub kind: &'static str,
    /// What is wrong with it.
    pub reason: &'static str,
}

impl NameError {
    /// The article of the kind.
    pub fn article(&self) -> &'static str {
        if self.kind.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
    }
}

fn is_plain(text: &str) -> bool {
    let mut bytes = text.bytes();
    matches!(bytes.next(), Some(b) if b.is_ascii_alphabetic() || b == b'_')
        && bytes.all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

const PLAIN: &str = "letters, digits and `_`, not starting with a digit";

/// What is made of its text by `new`, and everywhere shown as it.
macro_rules! text {
    ($name:ident) => {
        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }

        impl std::str::FromStr for $name {
            type Err = NameError;
            fn from_str(text: &str) -> Result<Self, NameError> {
                Self::new(text)
            }
        }

        sent_as_shown!($name);
    };
}

macro_rules! name {
    ($(#[$doc:meta])* $name:ident, $kind:literal, $valid:expr, $reason:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(Ustr);

        impl $name {
            /// The name, or why `text` cannot be one.
            ///
            /// # Errors
            /// When `text` does not follow the grammar above.
            pub fn new(text: &str) -> Result<Self, NameError> {
                let valid: fn(&str) -> bool = $valid;
                if valid(text) {
                    Ok(Self(Ustr::from(text)))
                } else {
                    Err(NameError { text: text.to_owned(), kind: $kind, reason: $reason })
                }
            }

            /// The text of the name.
            pub fn as_str(&self) -> &'static str {
                self.0.as_str()
            }

            /// Where the text is kept: the same for the same name, and known without looking at the text. To hash names
            /// by where it matters; it differs from run to run, so nothing may be ordered by it.
            pub fn address(&self) -> usize {
                self.0.as_char_ptr() as usize
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.as_str())
            }
        }

        text!($name);
    };
}

name!(
    /// A plain name: of a port, a property, an operation, an activity, a group, a deployment, a record field.
    Ident, "name", is_plain, PLAIN
);
name!(
    /// A component's name, with the prefix of its subsystem where it has one: `Dynamics`, `left/Dynamics`.
    ComponentName, "component name", |t| t.split('/').all(is_plain),
    "plain names (letters, digits, `_`) separated by `/`"
);
name!(
    /// A component type's name: `Gain`, `youbot.Dynamics`; of what is a subsystem's own, with its path.
    TypeName, "component type name", |t| {
        let (path, own) = t.rsplit_once('/').map_or((None, t), |(path, own)| (Some(path), own));
        own.split('.').all(is_plain) && path.is_none_or(|path| path.split('/').all(is_plain))
    },
    "plain names (letters, digits, `_`) separated by `.`"
);
name!(
    /// A configuration's name (its ID), with the prefix of its subsystem where it has one.
    ConfigId, "configuration name", |t| t.split('/').all(is_plain),
    "plain names (letters, digits, `_`) separated by `/`"
);
name!(
    /// An event. rFSM models use nearly any text (`e_done@root.a`, `jnt1eff.e_LIM_true`), so only blanks, control
    /// characters and the empty text are refused: events travel one per word in files of events.
    EventName, "event name", |t| !t.is_empty() && !t.chars().any(|c| c.is_whitespace() || c.is_control()),
    "an event is a non-empty text without blanks"
);

/// What stands in the file of a subsystem under a name has that name there, and the path of the subsystem before it outside.
macro_rules! scoped {
    ($($name:ident),*) => {$(
        impl $name {
            /// The same as it is called outside of the subsystem of that path, in whose file it stands: `left/Dynamics`.
            #[must_use]
            pub fn within(self, path: Ident) -> Self {
                Self(Ustr::from(&format!("{path}/{self}")))
            }

            /// As it is called in the file of the subsystem of that path; none where it stands in another one.
            pub fn local(&self, path: Ident) -> Option<&'static str> {
                local_to(self.as_str(), path.as_str())
            }
        }
    )*};
}

scoped!(Ident, ComponentName, TypeName, ConfigId, EventName);

/// What a name, or a path, is called in the file of the subsystem of that path; none where it stands in another one. In the
/// deployment's own file, whose path is empty, everything is called as from outside.
pub fn local_to<'n>(name: &'n str, path: &str) -> Option<&'n str> {
    if path.is_empty() { Some(name) } else { name.strip_prefix(path)?.strip_prefix('/') }
}

/// Whether a path is that of a subsystem, or of one in it; all are in the deployment itself.
pub fn is_within(path: &str, outer: &str) -> bool {
    path == outer || local_to(path, outer).is_some()
}

/// How many levels below the top the subsystem of that path is: 0 the deployment itself, whose path is empty.
pub fn level(path: &str) -> usize {
    if path.is_empty() { 0 } else { 1 + path.matches('/').count() }
}

/// The outermost subsystem on a path that is more than `depth` levels deep: what it is folded into. None: it is not that deep.
pub fn folded_into(path: &str, depth: usize) -> Option<&str> {
    let ends = path.match_indices('/').map(|(at, _)| at).chain([path.len()]);
    ends.filter(|end| *end > 0).nth(depth).map(|end| &path[..end])
}

impl Ident {
    /// The name without the path of a subsystem.
    pub fn last(&self) -> &'static str {
        self.as_str().rsplit_once('/').map_or(self.as_str(), |(_, last)| last)
    }
}

/// What stands before the last `/`. Names are short: it is found byte by byte.
fn prefix_of(name: &'static str) -> &'static str {
    name.bytes().rposition(|byte| byte == b'/').map_or("", |at| &name[..at])
}

impl ComponentName {
    /// The subsystem's path before the last `/`, empty at the top.
    pub fn prefix(&self) -> &'static str {
        prefix_of(self.as_str())
    }

    /// `self.member`
    pub fn member(self, member: Ident) -> MemberRef {
        MemberRef { component: self, member }
    }
}

/// Every plain name is a component name without a prefix.
/// A subsystem is written like a configuration of its name where a configuration is wanted.
impl From<Ident> for ConfigId {
    fn from(name: Ident) -> Self {
        Self(name.0)
    }
}

impl TypeName {
    /// The same of one component alone: what is seen of it from outside.
    #[must_use]
    pub fn of(self, component: ComponentName) -> Self {
        Self(Ustr::from(&format!("{component}/{self}")))
    }
}

impl From<Ident> for ComponentName {
    fn from(name: Ident) -> Self {
        Self(name.0)
    }
}

impl ConfigId {
    /// The name of what sets this one property or port, as an operator asks for it. No configuration that is written can be
    /// called so.
    pub fn setting(member: MemberRef) -> Self {
        Self(Ustr::from(&member.to_string()))
    }

    /// The same to this value: of what an operator may set `check` follows several, and each is answered like that one.
    pub fn setting_to(member: MemberRef, value: &Value) -> Self {
        Self(Ustr::from(&format!("{member}={value}")))
    }

    /// What it sets, and to what as Lua has it, if it sets one property or port to a value.
    pub fn sets(&self) -> Option<(&'static str, &'static str)> {
        self.as_str().split_once('=')
    }

    /// The subsystem's path before the last `/`, empty at the top.
    pub fn prefix(&self) -> &'static str {
        prefix_of(self.as_str())
    }
}

/// `Component.member`: a port, a property or an operation of a component.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MemberRef {
    /// The component.
    pub component: ComponentName,
    /// The port, property or operation.
    pub member: Ident,
}

impl MemberRef {
    /// The reference, or why `text` is not of the form `Component.member`.
    ///
    /// # Errors
    /// One that names the part at fault.
    pub fn new(text: &str) -> Result<Self, NameError> {
        let Some((component, member)) = text.split_once('.') else {
            return Err(NameError {
                text: text.to_owned(),
                kind: "reference to a member",
                reason: "it is written `Component.member`",
            });
        };
        Ok(Self { component: ComponentName::new(component)?, member: Ident::new(member)? })
    }
}

impl fmt::Display for MemberRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.component, self.member)
    }
}

text!(MemberRef);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grammar() {
        assert!(Ident::new("force_gain").is_ok());
        assert!(Ident::new("9lives").is_err());
        assert!(Ident::new("").is_err());
        assert!(ComponentName::new("left/Dynamics").is_ok());
        assert!(ComponentName::new("left//Dynamics").is_err());
        assert!(TypeName::new("youbot.Dynamics").is_ok());
        assert_eq!(MemberRef::new("left/D.k").unwrap().to_string(), "left/D.k");
        assert!(MemberRef::new("D").is_err());
        assert!(MemberRef::new("D.k.x").is_err());
        assert!(EventName::new("e_done@root.a").is_ok());
        assert!(EventName::new("e b").is_err());
        assert_eq!(ComponentName::new("left/D").unwrap().prefix(), "left");
    }

    #[test]
    fn a_path_is_within_itself_and_what_is_around_it() {
        assert_eq!([local_to("left/D", "left"), local_to("lefty/D", "left")], [Some("D"), None]);
        assert_eq!([local_to("left", "left"), local_to("left/D", "")], [None, Some("left/D")]);
        let within = |path, outer| is_within(path, outer);
        assert!(within("left", "left") && within("left/arm", "left") && within("left", "") && within("", ""));
        assert!(!within("lefty", "left") && !within("", "left") && !within("left", "left/arm"));
    }

    #[test]
    fn what_is_deep_is_folded_into_the_first_that_is_too_deep() {
        assert_eq!([level(""), level("left"), level("left/arm")], [0, 1, 2]);
        let of = |path, depth| folded_into(path, depth);
        assert_eq!(
            [of("left/arm/hand", 0), of("left/arm/hand", 1), of("left/arm", 2)],
            [Some("left"), Some("left/arm"), None]
        );
        assert_eq!([of("", 0), of("left", 0), of("left", 1)], [None, Some("left"), None]);
    }
}
