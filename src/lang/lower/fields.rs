//! Fields of a table as values: what each is, its bounds, its words and its example stand in its row.

use super::{Unit, choice, entries, name, number, one_or_more, text, time, truth, whole};
use crate::lang::grammar::Form;
use crate::lang::tree::{Cx, Entry, Fields, Node};
use crate::model::names::NameError;
use std::str::FromStr;
use std::time::Duration;

impl Fields {
    /// A truth value.
    pub fn truth(&mut self, cx: &mut Cx, key: &'static str) -> Option<bool> {
        let node = self.take(cx, key)?;
        truth(cx, &node, &format!("`{key}`"), self.row(key).example)
    }

    /// A text.
    pub fn text(&mut self, cx: &mut Cx, key: &'static str) -> Option<String> {
        let node = self.take(cx, key)?;
        text(cx, &node, &format!("`{key}`"), self.row(key).example)
    }

    /// A finite number.
    pub fn number(&mut self, cx: &mut Cx, key: &'static str) -> Option<f64> {
        let node = self.take(cx, key)?;
        number(cx, &node, &format!("`{key}`"), self.row(key).example)
    }

    /// A whole number within the bounds of its row.
    ///
    /// # Panics
    /// When its row says that it is something else.
    pub fn whole(&mut self, cx: &mut Cx, key: &'static str) -> Option<i64> {
        let node = self.take(cx, key)?;
        let row = self.row(key);
        let Form::Whole { least, most } = row.form else { panic!("`{key}` is no whole number") };
        whole(cx, &node, &format!("`{key}`"), least..=most, row.example)
    }

    /// A time in the unit of its row.
    ///
    /// # Panics
    /// When its row says that it is something else.
    pub fn time(&mut self, cx: &mut Cx, key: &'static str) -> Option<Duration> {
        let node = self.take(cx, key)?;
        let row = self.row(key);
        let unit = match row.form {
            Form::Seconds => Unit::Seconds,
            Form::Milliseconds => Unit::Milliseconds,
            _ => panic!("`{key}` is no time"),
        };
        time(cx, &node, &format!("`{key}`"), unit, row.example)
    }

    /// One of the words of its row, each with what it stands for.
    pub fn choice<T: Copy>(&mut self, cx: &mut Cx, key: &'static str, words: &[(&'static str, T)]) -> Option<T> {
        let node = self.take(cx, key)?;
        self.one_of(cx, key, &node, words)
    }

    /// Several of them.
    pub fn choices<T: Copy>(&mut self, cx: &mut Cx, key: &'static str, words: &[(&'static str, T)]) -> Vec<T> {
        let nodes = self.several(cx, key);
        nodes.iter().filter_map(|node| self.one_of(cx, key, node, words)).collect()
    }

    fn one_of<T: Copy>(&self, cx: &mut Cx, key: &str, node: &Node, words: &[(&'static str, T)]) -> Option<T> {
        debug_assert!(
            words.iter().map(|(word, _)| *word).eq(words_of(&self.row(key).form).iter().copied()),
            "the words of `{key}` are not those of its row"
        );
        choice(cx, node, &format!("`{key}`"), words)
    }

    /// A name.
    pub fn name<T: FromStr<Err = NameError>>(&mut self, cx: &mut Cx, key: &'static str) -> Option<T> {
        let node = self.take(cx, key)?;
        name(cx, &node, &format!("`{key}`"), self.row(key).example)
    }

    /// The entries of a table of named values.
    pub fn entries(&mut self, cx: &mut Cx, key: &'static str) -> Vec<Entry> {
        let node = self.take(cx, key);
        node.map(|node| entries(cx, node, &format!("`{key}`"), self.row(key).example)).unwrap_or_default()
    }

    /// One node or several.
    pub fn several(&mut self, cx: &mut Cx, key: &'static str) -> Vec<Node> {
        self.take(cx, key).map(one_or_more).unwrap_or_default()
    }
}

/// The words that a form lets stand.
fn words_of(form: &Form) -> &'static [&'static str] {
    match form {
        Form::Choice(words) => words,
        Form::Several(form) | Form::Set(form) | Form::List(form) => words_of(form),
        Form::Either(forms) => forms.iter().map(words_of).find(|words| !words.is_empty()).unwrap_or_default(),
        _ => &[],
    }
}
