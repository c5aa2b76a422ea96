//! A Lenze 9300 servo position controller as a model.
