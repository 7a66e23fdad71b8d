//! Shapes by values.
