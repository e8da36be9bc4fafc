//! What an operator may set in a case: one value of each property and in-port, as the configurations that `check` follows for it.

use crate::generate::Chance;
use davit::model::{ChangeKind, ConfigId, Configuration, Deployment, MemberRef, Value};

/// A value of a property or an in-port.
pub struct Setting {
    pub member: MemberRef,
    pub value: f64,
}

impl Setting {
    /// Those of a case. Some values are such that configurations give, too.
    pub fn all(chance: &mut Chance) -> Vec<Self> {
        let members = ["a.k", "a.s", "a.u", "b.k", "b.s", "b.u", "c.k", "c.s", "c.u"];
        let of = |name: &str| MemberRef::new(name).expect("a member");
        members.map(|name| Self { member: of(name), value: *chance.of(&[0.0, 2.0, 7.0, 7.0]) }).into()
    }

    /// What it is asked for as, and answered.
    pub fn id(&self) -> ConfigId {
        ConfigId::setting(self.member)
    }

    fn configuration(&self) -> Configuration {
        let (member, value) = (self.member, Value::Float(self.value));
        let kind = match member.member.as_str() {
            "u" => ChangeKind::PortWrite { port: member, value },
            _ => ChangeKind::PropertySet { property: member, value },
        };
        Configuration::setting(self.id(), kind)
    }
}

/// The deployment as `check` follows it.
pub fn followed(deployment: &Deployment, settings: &[Setting]) -> Deployment {
    let mut followed = deployment.clone();
    followed.configurations.extend(settings.iter().map(Setting::configuration));
    followed
}
