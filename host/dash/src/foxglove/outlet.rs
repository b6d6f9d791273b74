//! The topics of a recording as channels of the server.

use std::sync::Arc;

use cathforce_recording::{MESSAGE_ENCODING, SCHEMA_ENCODING, TopicError, TopicMessage, Topics};
use foxglove::{ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema};

/// Makes messages and hands them to whoever has subscribed to them.
pub struct Outlet {
    pub topics: Topics,
    channels: Vec<Arc<RawChannel>>,
    context: Arc<Context>,
}

impl Outlet {
    pub fn new() -> Result<Self, FoxgloveError> {
        let (context, topics) = (Context::new(), Topics::default());
        let channel = |topic: &cathforce_recording::Topic| {
            let schema = topic.schema.clone().into_bytes();
            ChannelBuilder::new(topic.name)
                .context(&context)
                .message_encoding(MESSAGE_ENCODING)
                .schema(Schema::new(topic.message_type, SCHEMA_ENCODING, schema))
                .build_raw()
        };
        let channels = topics.all().iter().map(channel).collect::<Result<_, _>>()?;
        Ok(Self { topics, channels, context })
    }

    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }
}

impl crate::stamped::Outlet for Outlet {
    fn topics(&mut self) -> &mut Topics {
        &mut self.topics
    }

    fn send(&mut self, messages: Result<Vec<TopicMessage>, TopicError>) {
        // Every message has fields that its encoding can hold; one that it could not hold is left out.
        for message in messages.unwrap_or_default() {
            if let Some(channel) = self.channels.get(message.topic) {
                channel
                    .log_with_meta(&message.bytes, PartialMetadata::with_log_time(message.at_ns));
            }
        }
    }
}
