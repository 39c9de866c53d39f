# Makes an interactive zsh print the candidates of the next completion between two marks, and end.
say_begin() { print '<begin>' }
say_end() { print '<end>'; exit }
compprefuncs=(say_begin); comppostfuncs=(say_end)
compadd() {
  if [[ "$*" == *'-'[OAD]' '* ]]; then builtin compadd "$@"; return; fi
  local -a found
  builtin compadd -A found "$@"
  (( $#found )) && print -l -- "${found[@]}"
  builtin compadd "$@"
}
