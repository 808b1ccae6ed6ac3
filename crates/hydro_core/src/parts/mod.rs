//! The submodels of chapter 3 (Fri & Fahlén, 2017), one a file.

pub mod area_table;
pub mod bulk_modulus;
pub mod compensator;
pub mod cylinder;
pub mod end_stop;
pub mod force_balance;
pub mod lugre;
pub mod orifice;
pub mod stiff_valve;
pub mod valve;
pub mod viscosity;
pub mod volume;
