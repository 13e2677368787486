/// \file
/// What is the same in every exported model.
#pragma once

namespace llmt {

/// Types of the tables. "@" stands for the name.
extern const char* const c_tables;

/// Functions that evaluate the tables, behind c_tables.
extern const char* const c_runtime;

}  // namespace llmt
