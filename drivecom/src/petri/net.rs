//! The net table and its executor.

use super::marking::{Marking, Places};

/// What a transition asks beside its places. The context answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Guard {
    /// Always true; the context is not asked.
    Always,
    /// The telegram at the address register is a read (bit 0 of its service octet).
    #[doc(alias = "Lesebefehl")]
    TelegramIsRead,
    /// The telegram at the address register is a write (bit 1 of its service octet).
    #[doc(alias = "Schreibbefehl")]
    TelegramIsWrite,
    /// The received service octet has its handshake bit (bit 6) set.
    HandshakeSet,
    /// The received service octet has its handshake bit (bit 6) clear.
    HandshakeClear,
    /// The telegram counter is above 5: the round of seven is over.
    CounterAboveFive,
}

/// What a transition does beside moving tokens. The context does it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Action {
    /// T1: telegram pointer := first telegram.
    PointToFirst,
    /// T2: address register := telegram pointer.
    LoadAddress,
    /// T4: send.data := telegram.data.
    LatchWriteData,
    /// T5: send.service := telegram.service with bit 6 cleared.
    SendServiceHandshakeCleared,
    /// T6: send.service := telegram.service with bit 6 set.
    SendServiceHandshakeSet,
    /// T7: send.subindex and send.index := the telegram's.
    SendAddressing,
    /// T10: telegram.data := received.data.
    StoreReadData,
    /// T12: counter above 5: counter := 0; otherwise counter += 1 and telegram pointer += 8.
    NextTelegram,
    /// T13: read 8 octets of the parameter channel, then write 8 octets; in this order.
    ExchangeParameterImage,
}

/// Where a transition puts its tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Puts {
    /// Always to the same places.
    Places(Places),
    /// To `then` when the guard holds at the moment of firing, before the action; to `otherwise` when not.
    Choice {
        /// The question, asked before the action changes its answer.
        when: Guard,
        /// Places when it holds.
        then: Places,
        /// Places when it does not.
        otherwise: Places,
    },
}

/// One row of the net table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transition {
    /// Number as in the figure: 1 is T1.
    pub number: u8,
    /// Places that must hold a token and lose it.
    pub takes: Places,
    /// Places that must be empty.
    pub needs_empty: Places,
    /// Further condition.
    pub guard: Guard,
    /// Places that get a token.
    pub puts: Puts,
    /// What is done after the tokens moved.
    pub action: Option<Action>,
}

impl Transition {
    /// Whether the places allow firing; the guard is not asked.
    #[must_use]
    pub const fn is_marked(&self, marking: Marking) -> bool {
        marking.holds_all(self.takes) && !marking.holds_any(self.needs_empty)
    }
}

/// The world of the net: answers guards and carries out actions.
pub trait NetContext {
    /// The truth of a guard now. [`Guard::Always`] is never asked.
    fn guard(&self, guard: Guard) -> bool;

    /// Carries out an action.
    fn act(&mut self, action: Action);
}

/// The transitions that fired in one cycle; T*n* is bit *n* − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Firing(u16);

impl Firing {
    /// Whether transition `number` (1…16) fired.
    #[must_use]
    pub const fn fired(self, number: u8) -> bool {
        number >= 1 && number <= 16 && self.0 & (1 << (number - 1)) != 0
    }

    /// Numbers of the fired transitions, in the order of firing.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (1..=16).filter(move |n| self.fired(*n))
    }
}

/// A net: transitions in the order in which a cycle tests them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Net<'a> {
    /// The rows, tested from first to last.
    pub transitions: &'a [Transition],
}

impl Net<'_> {
    /// Runs one PLC cycle: tests every transition once, in order, and fires those that are enabled at that moment.
    ///
    /// A token moved by an early transition is seen by the later ones of the same cycle; one that moves backwards
    /// (T12 to place 1 or 2, T13 to place 10) waits for the next cycle. Tokens move before the action is carried
    /// out, as in the block. Work is bounded by the number of rows; nothing is allocated.
    ///
    /// # Example
    ///
    /// ```
    /// use drivecom::petri::{Action, Guard, NetContext, PARAMETER_NET, RESET_MARKING};
    ///
    /// struct AlwaysWrite;
    /// impl NetContext for AlwaysWrite {
    ///     fn guard(&self, guard: Guard) -> bool {
    ///         matches!(guard, Guard::TelegramIsWrite | Guard::HandshakeClear)
    ///     }
    ///     fn act(&mut self, _: Action) {}
    /// }
    ///
    /// let mut marking = RESET_MARKING;
    /// let fired = PARAMETER_NET.fire_cycle(&mut marking, &mut AlwaysWrite);
    /// assert!(fired.iter().eq([1, 2, 4, 6, 7, 13]));
    /// assert_eq!(marking.places().to_string(), "{6, 7, 10}");
    /// ```
    #[inline]
    pub fn fire_cycle<C: NetContext + ?Sized>(&self, marking: &mut Marking, context: &mut C) -> Firing {
        let mut fired = 0_u16;
        for transition in self.transitions {
            if fire(transition, marking, context) {
                fired |= 1_u16
                    .checked_shl(u32::from(transition.number).wrapping_sub(1))
                    .unwrap_or(0);
            }
        }
        Firing(fired)
    }
}

/// The marking after a reset and at power-up: places 1 and 10.
///
/// `Error_RESET` writes it and ends the block's cycle; the counter and the pointer are left alone.
/// Source: film-feed specification, section 8, step 12 (`W#16#102` in the block).
pub const RESET_MARKING: Marking = Marking::new(Places::of(&[1, 10]));

/// The rows T1…T13 of the block's parameter exchange.
///
/// Source: film-feed specification, section 8, table of step 12.
pub const PARAMETER_TRANSITIONS: [Transition; 13] = [
    row(1, &[1], &[2], Guard::Always, &[2], Some(Action::PointToFirst)),
    row(2, &[10], &[11], Guard::Always, &[11], Some(Action::LoadAddress)),
    row(3, &[2], &[3], Guard::TelegramIsRead, &[3], None),
    row(
        4,
        &[2],
        &[3],
        Guard::TelegramIsWrite,
        &[3],
        Some(Action::LatchWriteData),
    ),
    row(
        5,
        &[3],
        &[4, 5],
        Guard::HandshakeSet,
        &[4, 5],
        Some(Action::SendServiceHandshakeCleared),
    ),
    row(
        6,
        &[3],
        &[4, 7],
        Guard::HandshakeClear,
        &[4, 7],
        Some(Action::SendServiceHandshakeSet),
    ),
    row(7, &[4], &[6], Guard::Always, &[6], Some(Action::SendAddressing)),
    row(8, &[6, 5], &[9], Guard::HandshakeClear, &[9], None),
    row(9, &[6, 7], &[9], Guard::HandshakeSet, &[9], None),
    row(10, &[9], &[8], Guard::TelegramIsRead, &[8], Some(Action::StoreReadData)),
    row(11, &[9], &[8], Guard::TelegramIsWrite, &[8], None),
    Transition {
        number: 12,
        takes: Places::of(&[8]),
        needs_empty: Places::of(&[1, 2]),
        guard: Guard::Always,
        puts: Puts::Choice {
            when: Guard::CounterAboveFive,
            then: Places::of(&[1]),
            otherwise: Places::of(&[2]),
        },
        action: Some(Action::NextTelegram),
    },
    row(
        13,
        &[11],
        &[10],
        Guard::Always,
        &[10],
        Some(Action::ExchangeParameterImage),
    ),
];

/// The block's parameter exchange net.
#[doc(alias = "Telegrammkommunikation")]
pub const PARAMETER_NET: Net<'static> = Net {
    transitions: &PARAMETER_TRANSITIONS,
};

#[inline]
fn fire<C: NetContext + ?Sized>(transition: &Transition, marking: &mut Marking, context: &mut C) -> bool {
    if !transition.is_marked(*marking) || !holds(transition.guard, context) {
        return false;
    }
    let puts = match transition.puts {
        Puts::Places(places) => places,
        Puts::Choice { when, then, otherwise } => {
            if holds(when, context) {
                then
            } else {
                otherwise
            }
        }
    };
    *marking = marking.moved(transition.takes, puts);
    if let Some(action) = transition.action {
        context.act(action);
    }
    true
}

#[inline]
fn holds<C: NetContext + ?Sized>(guard: Guard, context: &C) -> bool {
    matches!(guard, Guard::Always) || context.guard(guard)
}

const fn row(
    number: u8,
    takes: &[u8],
    needs_empty: &[u8],
    guard: Guard,
    puts: &[u8],
    action: Option<Action>,
) -> Transition {
    Transition {
        number,
        takes: Places::of(takes),
        needs_empty: Places::of(needs_empty),
        guard,
        puts: Puts::Places(Places::of(puts)),
        action,
    }
}
