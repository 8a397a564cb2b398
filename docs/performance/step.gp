set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'step.png'
set datafile separator comma
set title 'A step of the race profile, K = 20'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'rollouts M'
set logscale x
set ylabel 'step, median [ms]'
set logscale y
plot 'step.csv' skip 1 every ::0::5 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'one core', \
     'step.csv' skip 1 every ::6::11 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'two cores', \
     'step.csv' skip 1 every ::12::17 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'one core, all decoded', \
     'step.csv' skip 1 every ::18::23 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#cc79a7' title 'two cores, all decoded'
