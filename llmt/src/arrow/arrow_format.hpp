/// \file
/// Numbers of the fields of an Arrow file's metadata (format/Message.fbs, Schema.fbs and File.fbs of Apache Arrow).
#pragma once

#include <cstdint>
#include <string_view>

namespace llmt::arrow_format {

inline constexpr std::string_view magic = "ARROW1";
inline constexpr std::uint32_t continuation = 0xffffffffU;  ///< before the length of a message
inline constexpr std::int16_t version_5 = 4;

namespace message {
inline constexpr int version = 0;
inline constexpr int header_type = 1;
inline constexpr int header = 2;
inline constexpr int body_length = 3;
inline constexpr std::uint8_t is_schema = 1;
inline constexpr std::uint8_t is_dictionary = 2;
inline constexpr std::uint8_t is_batch = 3;
}  // namespace message

namespace schema {
inline constexpr int endianness = 0;
inline constexpr int fields = 1;
}  // namespace schema

namespace field {
inline constexpr int name = 0;
inline constexpr int nullable = 1;
inline constexpr int type_type = 2;
inline constexpr int type = 3;
inline constexpr int dictionary = 4;
inline constexpr int children = 5;
}  // namespace field

namespace type {
inline constexpr std::uint8_t null = 1;
inline constexpr std::uint8_t integer = 2;
inline constexpr std::uint8_t floating = 3;
inline constexpr std::uint8_t text = 5;  ///< UTF-8, with offsets of 32 bits
inline constexpr std::uint8_t date = 8;
inline constexpr std::uint8_t moment = 10;
inline constexpr std::uint8_t large_text = 20;  ///< with offsets of 64 bits
inline constexpr int bit_width = 0;             ///< of an integer
inline constexpr int is_signed = 1;
inline constexpr int precision = 0;  ///< of a floating-point number
inline constexpr std::int16_t single_precision = 1;
inline constexpr std::int16_t double_precision = 2;
inline constexpr int unit = 0;  ///< of a date: 0 days, 1 milliseconds; of a moment: 0 seconds, 1 ms, 2 us, 3 ns
}  // namespace type

namespace dictionary {  // DictionaryEncoding of a field
inline constexpr int id = 0;
inline constexpr int index_type = 1;
}  // namespace dictionary

namespace dictionary_batch {
inline constexpr int id = 0;
inline constexpr int data = 1;
inline constexpr int is_delta = 2;
}  // namespace dictionary_batch

namespace batch {
inline constexpr int length = 0;
inline constexpr int nodes = 1;
inline constexpr int buffers = 2;
inline constexpr int compression = 3;
}  // namespace batch

namespace footer {
inline constexpr int version = 0;
inline constexpr int schema = 1;
inline constexpr int dictionaries = 2;
inline constexpr int batches = 3;
}  // namespace footer

}  // namespace llmt::arrow_format
