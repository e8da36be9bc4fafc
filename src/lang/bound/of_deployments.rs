//! What deployments are written with.

use super::{LIMITS, Pen, WrittenValue};
use crate::lang::grammar::{self, Key};
use crate::lang::lower::{name, once};
use crate::lang::print::fields::{list, table, texts};
use crate::lang::tree::{Cx, Fields, Kind};
use crate::model::{ConfigId, DeploymentLimits, MemberRef, OperatorMay, Origin};

/// Configurations, and properties and in-ports as `Component.member`.
impl WrittenValue for Vec<(OperatorMay, Origin)> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let example = fields.row(key).example;
        let mut all = Self::new();
        for node in fields.several(cx, key) {
            let is_member = matches!(&node.kind, Kind::Str(text) if text.contains('.'));
            let may = if is_member {
                name::<MemberRef>(cx, &node, "a property or port", example).map(OperatorMay::Set)
            } else {
                name::<ConfigId>(cx, &node, "a configuration", example).map(OperatorMay::Apply)
            };
            if let Some(may) = may {
                once(cx, &mut all, may, node.origin, &format!("`{key}`"));
            }
        }
        Some(all)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self.iter().map(|(may, _)| may), pen.language), pen.language)
    }
}

/// Bounds, each with a default.
impl WrittenValue for DeploymentLimits {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let node = fields.take(cx, key)?;
        let mut limits = Self::default();
        let mut fields = Fields::of(cx, node, &grammar::LIMITS)?;
        LIMITS.read(&mut limits, &mut fields, cx);
        fields.finish(cx);
        Some(limits)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        *self == Self::default()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        table(LIMITS.written(self, pen), pen.language)
    }
}
