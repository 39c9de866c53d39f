# Completes the words that it is given in an interactive zsh of its own, and prints the candidates.
zmodload zsh/zpty
zpty z zsh -f -i
wait_for() { local line; while zpty -r z line; do  [[ $line == *$1* ]] && return; done }
zpty -w z 'PROMPT=; stty -echo; fpath=($PWD $fpath); autoload -U compinit; compinit -u -D; bindkey "^I" complete-word; source ./capture.zsh; echo re""ady'
wait_for ready
zpty -n -w z "$1"$'\t'
line=; out=
while zpty -r z line; do 
  line=${line%%$'\r\n'}
  [[ $line == *'<begin>'* ]] && { out=1; continue }
  [[ $line == *'<end>'* ]] && break
  [[ -n $out ]] && print -r -- "$line"
done
zpty -d z
