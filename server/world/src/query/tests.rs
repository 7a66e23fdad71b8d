//! Queries by values and laws.
