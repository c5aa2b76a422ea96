//! The film feed: PLC block, bus, drive and film in one chain.
