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

/// Where a character of the text turns the rest of the line around, people read what is not there.
TEST(Text, DirectionsAreShown) {
  EXPECT_EQ(plain_text("a\xe2\x80\xae"
                       "b\xe2\x81\xa6\xe2\x80\xa8\xd8\x9c"),
            "a\\u202eb\\u2066\\u2028\\u061c");
  // An ellipsis, a euro sign and a letter share their first byte with them.
  EXPECT_EQ(plain_text("\xe2\x80\xa6 \xe2\x82\xac \xd8\xa7"), "\xe2\x80\xa6 \xe2\x82\xac \xd8\xa7");
  EXPECT_EQ(plain_text("cut \xe2\x80"), "cut \xe2\x80");
}

TEST(Text, NamesAreOneWord) { EXPECT_EQ(printable("a\tb\nc\x1b"), "a\\x09b\\x0ac\\x1b"); }

TEST(Text, MessagesAreOneLineOfBoundedLength) {
  EXPECT_EQ(one_line("a\nb\x1b"), "a b\\x1b");
  const std::string at_most(2000, 'x');
  EXPECT_EQ(one_line(at_most), at_most);
  std::string longer = "begin";
  for (int n = 0; n < 1'000'000; ++n) longer += "\xc3\xa9";
  const std::string cut = one_line(longer + "; give another");
  EXPECT_LE(cut.size(), 2000u);
  EXPECT_TRUE(cut.starts_with("begin\xc3\xa9")) << cut;
  EXPECT_TRUE(cut.ends_with("\xc3\xa9; give another")) << cut;
  // Letters of two bytes, none of them cut.
  const std::size_t middle = cut.find(" ... ");
  ASSERT_NE(middle, std::string::npos);
  EXPECT_EQ(cut[middle - 1], '\xa9');
  EXPECT_EQ(cut[middle + 5], '\xc3');
}

TEST(Text, MarkdownKeepsItsTablesAndBeginsNoHtml) {
  EXPECT_EQ(markdown_cell("a|b\nc"), "a\\|b c");
  EXPECT_EQ(markdown_cell("<script>x</script><!-- <?x"), "&lt;script>x&lt;/script>&lt;!-- &lt;?x");
  EXPECT_EQ(markdown_cell("|bias| < 0.5 and a <= b"), "\\|bias\\| < 0.5 and a <= b");
  EXPECT_EQ(markdown_code("nullmark replay 'a|b'"), "`nullmark replay 'a\\|b'`");
  EXPECT_EQ(markdown_code("a `b` ``c``"), "``` a `b` ``c`` ```");
}

TEST(Text, LatexTablesEscapeWhatLatexReads) {
  EXPECT_EQ(latex_table({{"a_b", "50 %"}, {"x<y^2", "1 \xc2\xb1 2"}}, 1, "c#1"),
            "\\begin{table}\n\\centering\n\\caption{c\\#1}\n\\resizebox{\\linewidth}{!}{%\n\\begin{tabular}{lr}\n\\toprule\n"
            "a\\_b & 50 \\% \\\\\n\\midrule\nx$<$y\\textasciicircum{}2 & 1 $\\pm$ 2 \\\\\n"
            "\\bottomrule\n\\end{tabular}}\n\\end{table}\n");
}

TEST(Text, XmlHoldsOnlyItsCharacters) {
  EXPECT_EQ(xml("a<b>&\"c\"\x1b"), "a&lt;b&gt;&amp;&quot;c&quot;\\x1b");
  EXPECT_EQ(xml("\xef\xbf\xbe|\xef\xbf\xbf|\xef\xbf\xbd"), "\xef\xbf\xbd|\xef\xbf\xbd|\xef\xbf\xbd");
  EXPECT_EQ(xml("cut \xc3"), "cut \xef\xbf\xbd");
}

}  // namespace
}  // namespace nullmark
