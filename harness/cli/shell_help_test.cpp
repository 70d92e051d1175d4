// What the shell knows of the program: completions and the page for man.

#include <cstdlib>

#include "harness/testing/program.h"

namespace nullmark {
namespace {

class ShellHelp : public ProgramTest {
 protected:
  /// What bash offers for the last of some words.
  std::string offered(const std::string& words, int last) {
    write("try.sh", "source completion\nCOMP_WORDS=(" + words + ")\nCOMP_CWORD=" + std::to_string(last) +
                        "\n_nullmark\necho \"${COMPREPLY[@]}\"\n");
    EXPECT_EQ(std::system(("cd " + folder_.string() + " && bash try.sh > offered").c_str()), 0);
    return read("offered");
  }
};

TEST_F(ShellHelp, BashCompletesCommandsOptionsAndFiles) {
  ASSERT_EQ(run("completion bash"), 0);
  write("completion", read("out"));
  write("results.json", "{}");
  EXPECT_EQ(offered("nullmark ru", 1), "run\n");
  EXPECT_EQ(offered("nullmark run --cov", 2), "--covering\n");
  EXPECT_EQ(offered("nullmark check res", 2), "results.json\n");
  EXPECT_EQ(offered("nullmark list est", 2), "estimators\n");
}

TEST_F(ShellHelp, EveryShellAndTheManualKnowEveryCommandAndOption) {
  ASSERT_EQ(run("help"), 0);
  const std::string list = read("out");
  for (const char* page : {"completion bash", "completion zsh", "completion fish", "manual"}) {
    ASSERT_EQ(run(page), 0) << page;
    std::string text = read("out");
    for (std::size_t at; (at = text.find("\\-")) != std::string::npos;) text.replace(at, 2, "-");
    for (const char* word : {"run", "prove", "judge", "make-volume", "covering", "allow-foreign", "quiet-machine"})
      EXPECT_NE(text.find(word), std::string::npos) << page << ": " << word;
  }
  EXPECT_NE(list.find("make-volume"), std::string::npos);
}

TEST_F(ShellHelp, HelpIsOfACommand) {
  ASSERT_EQ(run("help check"), 0);
  const std::string help = read("out");
  ASSERT_EQ(run("check --help"), 0);
  EXPECT_EQ(help, read("out"));
  EXPECT_EQ(run("help chek"), 2);
  EXPECT_EQ(read("err"), "nullmark: unknown command \"chek\"; did you mean \"check\"?\n");
  EXPECT_EQ(run("completion csh"), 2);
}

}  // namespace
}  // namespace nullmark
