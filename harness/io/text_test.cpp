#include "harness/io/text.h"

#include <gtest/gtest.h>

namespace nullmark {
namespace {

TEST(Text, TerminalsObeyNothingOfIt) {
  EXPECT_EQ(plain_text("a\tb\nc"), "a\tb\nc");
  EXPECT_EQ(plain_text("\x1b]0;owned\x07\r\x7f"), "\\x1b]0;owned\\x07\\x0d\\x7f");
  // U+009B begins a command as ESC [ does; U+00E9 and U+0142 are letters that share a byte with it.
  EXPECT_EQ(plain_text("\xc2\x9b 31m \xc3\xa9 \xc5\x82"), "\\x9b 31m \xc3\xa9 \xc5\x82");
}

TEST(Text, MarkdownKeepsItsTablesAndBeginsNoHtml) {
  EXPECT_EQ(markdown_cell("a|b\nc"), "a\\|b c");
  EXPECT_EQ(markdown_cell("<script>x</script><!-- <?x"), "&lt;script>x&lt;/script>&lt;!-- &lt;?x");
  EXPECT_EQ(markdown_cell("|bias| < 0.5 and a <= b"), "\\|bias\\| < 0.5 and a <= b");
  EXPECT_EQ(markdown_code("nullmark replay 'a|b'"), "`nullmark replay 'a\\|b'`");
  EXPECT_EQ(markdown_code("a `b` ``c``"), "``` a `b` ``c`` ```");
}

TEST(Text, XmlHoldsOnlyItsCharacters) {
  EXPECT_EQ(xml("a<b>&\"c\"\x1b"), "a&lt;b&gt;&amp;&quot;c&quot; ");
  EXPECT_EQ(xml("\xef\xbf\xbe|\xef\xbf\xbf|\xef\xbf\xbd"), "\xef\xbf\xbd|\xef\xbf\xbd|\xef\xbf\xbd");
  EXPECT_EQ(xml("cut \xc3"), "cut \xef\xbf\xbd");
}

}  // namespace
}  // namespace nullmark
