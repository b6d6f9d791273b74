//! The macro that makes types from the table of effects, so that each parameter is declared once.

/// Declaration of one number that can be set by its key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Path of the field in a [`crate::Description`]; its name in settings and catalogues.
    pub key: &'static str,
    /// Unit of all numbers here; "1" if dimensionless.
    pub unit: &'static str,
    /// Value without effect; `None` for numbers that each rig states itself.
    pub off: Option<f64>,
    /// Smallest value accepted.
    pub min: f64,
    /// Largest value accepted.
    pub max: f64,
    /// Only whole numbers are accepted.
    pub whole: bool,
    /// What it is.
    pub doc: &'static str,
}

/// One effect of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectInfo {
    /// `group.effect`.
    pub id: &'static str,
    /// What it is.
    pub doc: &'static str,
    pub parameters: &'static [ParameterInfo],
}

/// `group: Type { effect: Type { parameter: unit, off, smallest, largest; … } … } …`
///
/// Makes a struct for each effect (with `off` and `is_off`) and for each group, [`Effects`] with all
/// groups, and the table [`EFFECTS`]. The path of a field is its key.
macro_rules! effects {
    ($(
        $(#[doc = $group_doc:literal])+
        $group:ident: $Group:ident {
            $(
                $(#[doc = $effect_doc:literal])+
                $effect:ident: $Effect:ident {
                    $(
                        $(#[doc = $doc:literal])+
                        $parameter:ident: $unit:literal, $off:expr, $min:expr, $max:expr;
                    )+
                }
            )+
        }
    )+) => {
        $( $(
            $(#[doc = $effect_doc])+
            #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
            pub struct $Effect<T> {
                $( $(#[doc = $doc])+ pub $parameter: T, )+
            }

            impl<T: Real> $Effect<T> {
                /// Changes nothing.
                pub fn off() -> Self {
                    Self { $( $parameter: T::lit($off), )+ }
                }

                /// Every number is that of [`Self::off`].
                pub fn is_off(&self) -> bool {
                    *self == Self::off()
                }
            }
        )+

        $(#[doc = $group_doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        pub struct $Group<T> {
            $( $(#[doc = $effect_doc])+ pub $effect: $Effect<T>, )+
        }

        impl<T: Real> $Group<T> {
            /// Changes nothing.
            pub fn off() -> Self {
                Self { $( $effect: $Effect::off(), )+ }
            }

            /// Every effect of the group is off.
            pub fn is_off(&self) -> bool {
                *self == Self::off()
            }
        }
        )+

        /// Every effect that the model can have beyond its nominal description.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        pub struct Effects<T> {
            $( $(#[doc = $group_doc])+ pub $group: $Group<T>, )+
        }

        impl<T: Real> Effects<T> {
            /// Changes nothing: the nominal model.
            pub fn off() -> Self {
                Self { $( $group: $Group::off(), )+ }
            }

            /// The number with this key; `None` if there is none.
            pub fn parameter_mut(&mut self, key: &str) -> Option<&mut T> {
                match key {
                    $( $( $(
                        parameter_key!($group, $effect, $parameter) =>
                            Some(&mut self.$group.$effect.$parameter),
                    )+ )+ )+
                    _ => None,
                }
            }
        }

        /// Every effect, in the order of [`Effects`].
        pub const EFFECTS: &[EffectInfo] = &[ $( $( EffectInfo {
            id: concat!(stringify!($group), ".", stringify!($effect)),
            doc: concat!($($effect_doc),+).trim_ascii(),
            parameters: &[ $( ParameterInfo {
                key: parameter_key!($group, $effect, $parameter),
                unit: $unit,
                off: Some($off),
                min: $min,
                max: $max,
                whole: false,
                doc: concat!($($doc),+).trim_ascii(),
            }, )+ ],
        }, )+ )+ ];
    };
}

/// The key of a parameter of an effect, as a literal.
macro_rules! parameter_key {
    ($group:ident, $effect:ident, $parameter:ident) => {
        concat!(
            "effects.",
            stringify!($group),
            ".",
            stringify!($effect),
            ".",
            stringify!($parameter)
        )
    };
}

pub(crate) use {effects, parameter_key};
