//! Faults, with codes that never change, and the reaction to each.
//!
//! A fault stops the output and latches. A limit ([`crate::LimitFlags`]) changes the output for one
//! tick and does not latch. Codes are grouped by origin: 1… encoders, 16… model, 32… device,
//! 48… the controller's own memory and settings. 0 is "no fault".

/// How the fault brings the output to zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// To zero within `ramp_time_ticks`, no faster than the slew limits.
    Ramp,
    /// Zero in the same tick.
    Cut,
}

macro_rules! faults {
    ($( $name:ident = $code:literal, $reaction:ident, $cause:literal, $next:literal; )+) => {
        /// A fault. Latched until cleared by name ([`Fault::clear_token`]).
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Fault {
            $( #[doc = concat!($cause, ": ", $next, ".")] $name = $code, )+
        }

        impl Fault {
            /// Every fault, by rising code.
            pub const ALL: &[Self] = &[ $( Self::$name, )+ ];

            /// The fault with this code on the bus; `None` for 0 and for unused codes.
            pub const fn from_code(code: u8) -> Option<Self> {
                match code {
                    $( $code => Some(Self::$name), )+
                    _ => None,
                }
            }

            /// Name of the variant.
            pub const fn name(self) -> &'static str {
                match self {
                    $( Self::$name => stringify!($name), )+
                }
            }

            /// What happened.
            pub const fn cause(self) -> &'static str {
                match self {
                    $( Self::$name => $cause, )+
                }
            }

            /// What to check and to do.
            pub const fn next_step(self) -> &'static str {
                match self {
                    $( Self::$name => $next, )+
                }
            }

            /// Cause and next step.
            pub const fn text(self) -> &'static str {
                match self {
                    $( Self::$name => concat!($cause, ": ", $next), )+
                }
            }

            /// How the fault brings the output to zero.
            pub const fn reaction(self) -> Reaction {
                match self {
                    $( Self::$name => Reaction::$reaction, )+
                }
            }
        }
    };
}

faults! {
    EncoderLost = 1, Ramp,
        "no valid encoder sample within the time-out",
        "check the drive, its cable and the bus";
    BadFrames = 2, Ramp,
        "more than 3 of 10 frames were rejected",
        "check the bus for corruption or a second sender";
    EncoderJump = 3, Ramp,
        "3 of 10 encoder samples jumped farther than the drive can move or left its range",
        "check the encoder's wiring and scale, or raise max_insertion_speed_m_per_s or \
         max_rotation_speed_rad_per_s";
    TendonLost = 4, Ramp,
        "no valid displacement of the tendons within the time-out",
        "check the tendons' drives, their cable and the bus";
    TendonJump = 5, Ramp,
        "3 of 10 displacements of the tendons jumped farther than the drives can move or left their range",
        "check the encoders' wiring and scale, or raise max_tendon_speed_m_per_s or max_tendon_m";
    ModelNotFinite = 16, Cut,
        "the model gave a number that is not finite; its state has been rebuilt",
        "replay the recording, and check the stiffness and the wall of rig.toml";
    ModelUnresolved = 17, Cut,
        "the model did not converge for too many ticks; its state has been rebuilt",
        "withdraw a little and arm again, or raise unresolved_limit_ticks";
    SettleTimeout = 18, Cut,
        "the model could not be fed to the measured insertion in time",
        "begin less deep, or raise settle_timeout_ticks";
    Overrun = 32, Cut,
        "the tick ran over its time twice in a row",
        "use fewer links or one solve";
    BusOff = 33, Ramp,
        "the bus controller went bus-off",
        "check termination, bit rate and cable";
    Hang = 34, Cut,
        "the tick or a task hung, and the watchdog reset the device",
        "read its record with `cathforce info`, keep it with the recording, and report it";
    Panic = 35, Cut,
        "the firmware found an error in itself and reset the device",
        "read its record with `cathforce info`, keep it with the recording, and report it";
    HardFault = 36, Cut,
        "the processor met an instruction or an address that it cannot use; the device was reset",
        "check the supply, read its record with `cathforce info`, and report it";
    StackOverflow = 37, Cut,
        "the stack outgrew its memory; the device was reset",
        "read its record with `cathforce info`, and report it";
    StateNotFinite = 48, Cut,
        "a number remembered from the last tick is not finite: memory is corrupt",
        "restart the device and send the image again";
    SelfTest = 49, Cut,
        "the self-test failed: a setting is out of range, or the image's tick is not 1 ms",
        "make the image again with this version";
    SavedImageLost = 50, Cut,
        "no image that the device had saved can be used: each is damaged or of another version",
        "configure the device and save it again with `cathforce config save`";
}

impl Fault {
    /// Code on the bus, never 0.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Token that [`crate::Command::ClearFault`] must carry to clear this fault.
    ///
    /// The token identifies the fault. A fault that the sender has not seen is therefore never cleared,
    /// and a frame of zeros or a repeated clear of another fault has no effect.
    pub const fn clear_token(self) -> u32 {
        0xC1EA_4F00 | self.code() as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_unique_and_go_there_and_back() {
        for code in 0..=u8::MAX {
            if let Some(fault) = Fault::from_code(code) {
                assert_eq!(fault.code(), code);
            }
        }
        for pair in Fault::ALL.windows(2) {
            assert!(pair[0].code() < pair[1].code());
        }
        assert_eq!(Fault::from_code(0), None);
        assert!(Fault::ALL.iter().all(|&f| Fault::from_code(f.code()) == Some(f)));
    }
}
