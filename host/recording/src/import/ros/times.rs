//! When each topic's messages were measured.

use super::bag::Bag;
use super::decoded::{Known, Received};
use super::message::Message;

/// Which time of a message counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RosClock {
    /// The time in the message's header, where it was measured.
    Stamp,
    /// When the recorder received it.
    Log,
}

/// The clocks of the topics.
pub(super) struct Times {
    clock: RosClock,
    /// For each topic, whether its stamps count.
    by_stamp: Vec<bool>,
    /// For each topic, the times from its stamps to its log, sorted \[ns\].
    delays_ns: Vec<Vec<i64>>,
}

impl Times {
    pub(super) fn of(bag: &Bag, messages: &[Received], clock: RosClock) -> Self {
        let topics = bag.topics.len();
        let mut by_stamp = vec![clock == RosClock::Stamp; topics];
        let mut delays_ns = vec![Vec::new(); topics];
        for one in messages {
            match stamp_ns(one) {
                Some(stamp_ns) => {
                    delays_ns[one.topic].push(one.logged_ns.saturating_sub(stamp_ns));
                }
                // A topic is timed by one clock.
                None => by_stamp[one.topic] = false,
            }
        }
        delays_ns.iter_mut().for_each(|delays| delays.sort_unstable());
        Self { clock, by_stamp, delays_ns }
    }

    /// The time of a message whose stamp is given.
    pub(super) fn ns(&self, message: &Received, stamp_ns: Option<i64>) -> i64 {
        stamp_ns.filter(|_| self.by_stamp[message.topic]).unwrap_or(message.logged_ns)
    }

    /// What is said of each topic that was read.
    pub(super) fn said(&self, bag: &Bag, messages: &[Received], known: &Known) -> Vec<String> {
        let mut spans: Vec<Option<(i64, i64, u64)>> = vec![None; bag.topics.len()];
        for one in messages {
            let ns = self.ns(one, stamp_ns(one));
            let (first, last, count) = spans[one.topic].unwrap_or((ns, ns, 0));
            spans[one.topic] = Some((first.min(ns), last.max(ns), count + 1));
        }
        let topics = bag.topics.iter().zip(spans).enumerate();
        let said = topics.filter_map(|(at, (topic, span))| {
            let (first, last, count) = span?;
            let span_s = last.saturating_sub(first) as f64 * 1e-9;
            let rate = match count > 1 && span_s > 0.0 {
                true => format!(", {:.1} Hz", (count - 1) as f64 / span_s),
                false => String::new(),
            };
            let frames = known.frames[at].iter().cloned().collect::<Vec<_>>().join(", ");
            let frames = if frames.is_empty() { frames } else { format!(", in {frames}") };
            Some(format!(
                "{} ({}): {count} messages over {span_s:.3} s{rate}{frames}; {}",
                topic.name,
                topic.kind,
                self.clock_of(at)
            ))
        });
        said.collect()
    }

    fn clock_of(&self, topic: usize) -> String {
        let delays = &self.delays_ns[topic];
        match (self.clock, self.by_stamp[topic], delays.get(delays.len() / 2)) {
            (RosClock::Stamp, true, Some(ns)) => {
                format!("timed by its stamps, {:.1} ms before the recorder", *ns as f64 * 1e-6)
            }
            (RosClock::Stamp, ..) => "timed by the recorder, because it has no stamps".into(),
            (RosClock::Log, ..) => "timed by the recorder".into(),
        }
    }
}

/// The stamp of a message; of transforms that of the first.
fn stamp_ns(message: &Received) -> Option<i64> {
    match &message.decoded.message {
        Message::Frames(frames) => frames.first().and_then(|frame| frame.stamp_ns),
        _ => message.decoded.stamp_ns,
    }
}
