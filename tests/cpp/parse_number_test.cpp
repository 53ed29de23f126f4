#include "support/parse_number.hpp"

#include <doctest/doctest.h>

#include <charconv>
#include <string_view>

namespace dynmesh::testing {
namespace {

#if !defined(_WIN32) && defined(__cpp_lib_to_chars)
TEST_CASE("numbers are read alike with and without std::from_chars") {
  for (const std::string_view text : {"0",
                                      "-0",
                                      "1",
                                      "-1.5",
                                      ".5",
                                      "5.",
                                      "1e3",
                                      "1E-3",
                                      "1e",
                                      "1e+",
                                      "-",
                                      "--1",
                                      "+1",
                                      "",
                                      " 1",
                                      "1 2",
                                      "1,5",
                                      "0x10",
                                      "1-2",
                                      "1.2.3",
                                      "1e400",
                                      "-1e400",
                                      "1e-400",
                                      "4.9e-324",
                                      "1e-310",
                                      "2.2250738585072011e-308",
                                      "0.1",
                                      "9007199254740993",
                                      "123456789012345678901234567890",
                                      "3.4028234663852886e+38x"}) {
    CAPTURE(text);
    double expected = 7;
    double value = 7;
    const char* end = text.data() + text.size();
    const auto one = std::from_chars(text.data(), end, expected);
    const auto other = parse_with_strtod(text.data(), end, value);
    CHECK(other.ec == one.ec);
    CHECK(other.ptr == one.ptr);
    CHECK(value == expected);
  }
}
#endif

}  // namespace
}  // namespace dynmesh::testing
