set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'compare-box-first-look-round-gates.png'
set datafile separator comma
set title 'Mean error within 1 m of the gate, round gates, first look'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'gate at'
set xrange [-0.6:4.6]
set xtics ('1 to 2 m' 0, '2 to 4 m' 1, '4 to 7 m' 2, 'core' 3, 'all' 4)
set ylabel 'box [m]'
set yrange [0:*]
set boxwidth 0.368
set style fill solid 0.85 noborder
plot 'compare-box-first-look-round-gates.csv' skip 1 every ::0::4 using ($2+-0.2):3 with boxes lc rgb '#0072b2' title 'race-round', \
     'compare-box-first-look-round-gates.csv' skip 1 every ::5::9 using ($2+0.2):3 with boxes lc rgb '#d55e00' title 'race'
