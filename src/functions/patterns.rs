//! How long Lua's pattern functions will take. They run in one piece, so nothing could end one that goes through all ways of
//! a pattern; `("a"):rep(40):find(("a?"):rep(40) .. ("a"):rep(40) .. "b")` takes years.
//!
//! Here a call that could take long is walked through beforehand, step by step under the call's budget, with Lua's own way
//! of trying (manual of Lua 5.4, §6.4.1). What it finds is not used: the answer is Lua's, and a pattern that is wrong is
//! Lua's to tell. So this needs to be right about the time only.

/// Steps that are taken without looking first: a fraction of a millisecond.
const FEW: f64 = 100_000.0;

/// Nested attempts, past which Lua refuses a pattern.
const DEPTH: usize = 200;

/// Groups of a pattern, past which Lua refuses it.
const CAPTURES: usize = 32;

/// Why a walk ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The budget is used up.
    Over,
    /// Lua will refuse the pattern.
    Wrong,
}

type Walked<T> = Result<T, Stop>;

/// The longest text on which a pattern takes [few](FEW) steps whatever the text; none: there is no such text.
pub fn room(pattern: &[u8]) -> Option<usize> {
    let (mut repeats, mut halves, mut items, mut at) = (1.0, 0.0, 1.0, 0);
    while at < pattern.len() {
        let longer = matches!(pattern[at..], [b'%', b'b' | b'0'..=b'9', ..]);
        let Ok(end) = class_end(pattern, at) else { break };
        items += 1.0;
        at = end;
        match pattern.get(at) {
            Some(b'*' | b'+' | b'-') => repeats += 1.0,
            Some(b'?') => halves += 1.0,
            _ if longer => repeats += 1.0,
            _ => continue,
        }
        at += 1;
    }
    let steps: f64 = FEW / items / f64::powf(2.0, halves);
    let length = steps.powf(1.0 / repeats).floor() - 1.0;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // small and not negative
    (length >= 0.0).then_some(length as usize)
}

/// Walks through a call on `text` from the byte `from` on: at most `matches` matches one after the other, the first at
/// `from` itself if `anchored`. `spend` is asked at every step; `false`: the budget is used up.
///
/// # Errors
/// The walk did not come to its end.
pub fn walk(
    text: &[u8],
    pattern: &[u8],
    from: usize,
    matches: usize,
    anchored: bool,
    spend: &mut dyn FnMut() -> bool,
) -> Walked<()> {
    let (mut at, mut last, mut found) = (from, None, 0);
    while at <= text.len() && found < matches {
        let mut walk = PatternWalk { text, pattern, captures: Vec::new(), depth: 0, spend };
        match walk.run(at, 0)? {
            Some(end) if last != Some(end) => {
                found += 1;
                last = Some(end);
                at = end;
            }
            _ => at += 1,
        }
        if anchored {
            break;
        }
    }
    Ok(())
}

/// Walks through a search for a plain text from the byte `from` on, as the library compares it place by place. Bytes of one
/// comparison are taken together: they are quick.
///
/// # Errors
/// The walk did not come to its end.
pub fn walk_plain(text: &[u8], what: &[u8], from: usize, spend: &mut dyn FnMut() -> bool) -> Walked<()> {
    let Some((first, rest)) = what.split_first() else { return Ok(()) };
    for at in from..text.len().saturating_sub(rest.len()) {
        if text[at] != *first {
            if at % 16 == 0 && !spend() {
                return Err(Stop::Over);
            }
            continue;
        }
        let same = rest.iter().zip(&text[at + 1..]).take_while(|(a, b)| a == b).count();
        for _ in 0..=same / 16 {
            if !spend() {
                return Err(Stop::Over);
            }
        }
        if same == rest.len() {
            break;
        }
    }
    Ok(())
}

/// Where the single item at `at` ends: a character, a class or a set.
fn class_end(pattern: &[u8], at: usize) -> Walked<usize> {
    let mut end = at + 1;
    match pattern.get(at) {
        Some(b'%') => (end < pattern.len()).then_some(end + 1).ok_or(Stop::Wrong),
        Some(b'[') => {
            end += usize::from(pattern.get(end) == Some(&b'^'));
            // The first may be a closing bracket that closes nothing.
            loop {
                let first = *pattern.get(end).ok_or(Stop::Wrong)?;
                end += 1 + usize::from(first == b'%');
                if pattern.get(end) == Some(&b']') {
                    return Ok(end + 1);
                }
            }
        }
        Some(_) => Ok(end),
        None => Err(Stop::Wrong),
    }
}

/// Whether a byte is of the class that a letter after `%` names.
fn is_of(byte: u8, class: u8) -> bool {
    let of = match class.to_ascii_lowercase() {
        b'a' => byte.is_ascii_alphabetic(),
        b'c' => byte.is_ascii_control(),
        b'd' => byte.is_ascii_digit(),
        b'g' => byte.is_ascii_graphic(),
        b'l' => byte.is_ascii_lowercase(),
        b'p' => byte.is_ascii_punctuation(),
        b's' => byte.is_ascii_whitespace() || byte == 0x0b,
        b'u' => byte.is_ascii_uppercase(),
        b'w' => byte.is_ascii_alphanumeric(),
        b'x' => byte.is_ascii_hexdigit(),
        _ => return byte == class,
    };
    of != class.is_ascii_uppercase()
}

/// Whether a byte is in a set, `[` and `]` included in its text.
fn is_in(byte: u8, set: &[u8]) -> bool {
    let inner = &set[1..set.len() - 1];
    let (not, mut rest) = inner.strip_prefix(b"^").map_or((false, inner), |rest| (true, rest));
    while let [first, after @ ..] = rest {
        let (hit, left) = match (first, after) {
            (b'%', [class, left @ ..]) => (is_of(byte, *class), left),
            (low, [b'-', high, left @ ..]) => ((*low..=*high).contains(&byte), left),
            _ => (*first == byte, after),
        };
        if hit {
            return !not;
        }
        rest = left;
    }
    not
}

#[derive(Clone, Copy)]
enum Length {
    Open,
    Position,
    Of(usize),
}

/// One attempt at one place.
struct PatternWalk<'a> {
    text: &'a [u8],
    pattern: &'a [u8],
    captures: Vec<(usize, Length)>,
    depth: usize,
    spend: &'a mut dyn FnMut() -> bool,
}

impl PatternWalk<'_> {
    /// Where the pattern from `p` on ends when it matches from `s` on.
    fn run(&mut self, s: usize, p: usize) -> Walked<Option<usize>> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(Stop::Wrong);
        }
        let outcome = self.items(s, p);
        self.depth -= 1;
        outcome
    }

    fn items(&mut self, mut s: usize, mut p: usize) -> Walked<Option<usize>> {
        loop {
            self.step()?;
            match &self.pattern[p..] {
                [] => return Ok(Some(s)),
                [b'(', b')', ..] => return self.open(s, p + 2, Length::Position),
                [b'(', ..] => return self.open(s, p + 1, Length::Open),
                [b')', ..] => return self.close(s, p + 1),
                [b'$'] => return Ok((s == self.text.len()).then_some(s)),
                [b'%', b'b', ..] => {
                    let Some(end) = self.balanced(s, p + 2)? else { return Ok(None) };
                    (s, p) = (end, p + 4);
                }
                [b'%', b'f', ..] => {
                    p += 2;
                    if self.pattern.get(p) != Some(&b'[') {
                        return Err(Stop::Wrong);
                    }
                    let end = class_end(self.pattern, p)?;
                    let before = s.checked_sub(1).map_or(0, |at| self.text[at]);
                    let here = self.text.get(s).copied().unwrap_or(0);
                    let set = &self.pattern[p..end];
                    if is_in(before, set) || !is_in(here, set) {
                        return Ok(None);
                    }
                    p = end;
                }
                [b'%', digit @ b'0'..=b'9', ..] => {
                    let number = usize::from(*digit).checked_sub(usize::from(b'1')).ok_or(Stop::Wrong)?;
                    let Some(end) = self.again(s, number)? else { return Ok(None) };
                    (s, p) = (end, p + 2);
                }
                _ => {
                    let end = class_end(self.pattern, p)?;
                    let fits = self.fits(s, p, end);
                    match (self.pattern.get(end), fits) {
                        (Some(b'+'), true) => return self.most(s + 1, p, end),
                        (Some(b'*'), true) => return self.most(s, p, end),
                        (Some(b'-'), true) => return self.least(s, p, end),
                        (Some(b'?'), true) => {
                            if let Some(found) = self.run(s + 1, end + 1)? {
                                return Ok(Some(found));
                            }
                            p = end + 1;
                        }
                        (Some(b'*' | b'-' | b'?'), false) => p = end + 1,
                        (_, false) => return Ok(None),
                        (_, true) => (s, p) = (s + 1, end),
                    }
                }
            }
        }
    }

    fn step(&mut self) -> Walked<()> {
        if (self.spend)() { Ok(()) } else { Err(Stop::Over) }
    }

    fn fits(&self, s: usize, p: usize, end: usize) -> bool {
        let Some(byte) = self.text.get(s).copied() else { return false };
        match self.pattern[p] {
            b'.' => true,
            b'%' => is_of(byte, self.pattern[p + 1]),
            b'[' => is_in(byte, &self.pattern[p..end]),
            other => other == byte,
        }
    }

    fn most(&mut self, s: usize, p: usize, end: usize) -> Walked<Option<usize>> {
        let mut count = 0;
        while self.fits(s + count, p, end) {
            self.step()?;
            count += 1;
        }
        for count in (0..=count).rev() {
            if let Some(found) = self.run(s + count, end + 1)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    fn least(&mut self, mut s: usize, p: usize, end: usize) -> Walked<Option<usize>> {
        loop {
            if let Some(found) = self.run(s, end + 1)? {
                return Ok(Some(found));
            }
            if !self.fits(s, p, end) {
                return Ok(None);
            }
            s += 1;
        }
    }

    fn open(&mut self, s: usize, p: usize, length: Length) -> Walked<Option<usize>> {
        if self.captures.len() >= CAPTURES {
            return Err(Stop::Wrong);
        }
        self.captures.push((s, length));
        let found = self.run(s, p)?;
        if found.is_none() {
            self.captures.pop();
        }
        Ok(found)
    }

    fn close(&mut self, s: usize, p: usize) -> Walked<Option<usize>> {
        let open = self.captures.iter().rposition(|(_, length)| matches!(length, Length::Open)).ok_or(Stop::Wrong)?;
        self.captures[open].1 = Length::Of(s - self.captures[open].0);
        let found = self.run(s, p)?;
        if found.is_none() {
            self.captures[open].1 = Length::Open;
        }
        Ok(found)
    }

    fn balanced(&mut self, s: usize, p: usize) -> Walked<Option<usize>> {
        let [first, last, ..] = self.pattern[p..] else { return Err(Stop::Wrong) };
        if self.text.get(s) != Some(&first) {
            return Ok(None);
        }
        let mut open = 1;
        for (at, byte) in self.text.iter().enumerate().skip(s + 1) {
            self.step()?;
            if *byte == last {
                open -= 1;
                if open == 0 {
                    return Ok(Some(at + 1));
                }
            } else if *byte == first {
                open += 1;
            }
        }
        Ok(None)
    }

    /// What a group matched, once more.
    fn again(&mut self, s: usize, number: usize) -> Walked<Option<usize>> {
        match self.captures.get(number).copied() {
            Some((start, Length::Of(length))) => {
                for _ in 0..length / 16 {
                    self.step()?;
                }
                let group = &self.text[start..start + length];
                Ok(self.text[s..].starts_with(group).then_some(s + length))
            }
            Some((_, Length::Position)) => Ok(None),
            Some((_, Length::Open)) | None => Err(Stop::Wrong),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Where the first match from the start begins; what the walk itself does not tell.
    fn first(text: &[u8], pattern: &[u8]) -> Walked<Option<(usize, usize)>> {
        let (anchored, pattern) = pattern.strip_prefix(b"^").map_or((false, pattern), |rest| (true, rest));
        for at in 0..=text.len() {
            let mut left = 3_000_000;
            let mut spend = || {
                left -= 1;
                left > 0
            };
            let mut walk = PatternWalk { text, pattern, captures: Vec::new(), depth: 0, spend: &mut spend };
            if let Some(end) = walk.run(at, 0)? {
                return Ok(Some((at, end)));
            }
            if anchored {
                break;
            }
        }
        Ok(None)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

        /// What it walks through is what Lua walks through: both find the same, and refuse the same.
        #[test]
        fn the_walk_is_luas(
            pattern in "[ab1%.()\\[\\]^$*+?\\-bfwW2]{0,9}",
            text in "[ab1 )-]{0,9}",
        ) {
            // Without any of these Lua looks for the text as it is.
            if !pattern.contains(['^', '$', '*', '+', '?', '.', '(', '[', '%', '-']) {
                return Ok(());
            }
            thread_local! {
                static LUA: mlua::Lua = mlua::Lua::new();
            }
            let theirs: Option<Option<(usize, usize)>> = LUA.with(|lua| {
                let find: mlua::Function = lua.load("return function(s, p)
                    local ok, i, j = pcall(string.find, s, p)
                    if not ok then return 'refused' end
                    if not i then return nil end
                    return i, j end").eval().expect("a function");
                let found: (mlua::Value, Option<usize>) = find.call((text.as_str(), pattern.as_str())).expect("it runs");
                match found {
                    (mlua::Value::Nil, _) => Some(None),
                    (mlua::Value::Integer(start), Some(end)) => Some(Some((usize::try_from(start).expect("from 1") - 1, end))),
                    _ => None,
                }
            });
            let ours = first(text.as_bytes(), pattern.as_bytes());
            match theirs {
                Some(theirs) => prop_assert_eq!(ours, Ok(theirs)),
                // A group that is never closed is refused only when the match is over.
                None => prop_assert_ne!(ours, Err(Stop::Over)),
            }
        }
    }

    #[test]
    fn what_can_take_long_is_seen_by_its_pattern() {
        for (pattern, text) in [("abc", 20_000), ("%d+", 150), ("^%s*(.-)%s*$", 8), ("[a-z*+?]", 40_000)] {
            let room = room(pattern.as_bytes()).expect("room");
            assert!((text / 2..text * 3).contains(&room), "{pattern}: {room}");
        }
        let bomb = format!("{}{}", "a?".repeat(30), "a".repeat(30));
        assert_eq!(room(bomb.as_bytes()), None);
        let mut left = 1_000_000;
        let mut spend = || {
            left -= 1;
            left > 0
        };
        assert_eq!(walk("a".repeat(29).as_bytes(), bomb.as_bytes(), 0, 1, false, &mut spend), Err(Stop::Over));
    }
}
