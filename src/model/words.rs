//! What is written by one word or text wherever it is written.

/// What is sent (in JSON, to whoever asks) as it is shown.
macro_rules! sent_as_shown {
    ($($name:ident),*) => {$(
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }
    )*};
}

/// An enum of which each value is one word wherever it is written, shown or sent: the words stand once, behind the values.
/// `by` names the method that answers the word.
macro_rules! words {
    ($(#[$about:meta])* pub enum $name:ident by $word:ident { $($(#[$of:meta])* $value:ident = $text:literal,)* }) => {
        $(#[$about])*
        pub enum $name {
            $($(#[$of])* $value,)*
        }

        impl $name {
            /// All, with their words.
            #[allow(dead_code)] // Not every list of words is asked for.
            pub const WORDS: &'static [(&'static str, Self)] = &[$(($text, Self::$value)),*];

            /// Its word.
            pub fn $word(self) -> &'static str {
                match self {
                    $(Self::$value => $text,)*
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.$word())
            }
        }

        $crate::model::words::sent_as_shown!($name);
    };
}

/// A set of marks of which each is one word wherever it is written or shown: the name of its field.
macro_rules! marks {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$of:meta])* pub $mark:ident: bool,)* }) => {
        $(#[$about])*
        pub struct $name {
            $($(#[$of])* pub $mark: bool,)*
        }

        impl $name {
            /// All words.
            pub const WORDS: &'static [&'static str] = &[$(stringify!($mark)),*];

            /// Those that are set.
            pub fn words(self) -> impl Iterator<Item = &'static str> {
                [$((stringify!($mark), self.$mark)),*].into_iter().filter(|(_, is)| *is).map(|(word, _)| word)
            }

            /// Sets that of a word.
            pub fn mark(&mut self, word: &str) {
                $(self.$mark |= word == stringify!($mark);)*
            }
        }
    };
}

pub(crate) use {marks, sent_as_shown, words};
